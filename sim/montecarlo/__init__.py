"""Monte-Carlo: many draws of a world on one estimator, and what they say of its honesty.

======== ==========================================================================================
module   what it holds
======== ==========================================================================================
campaign which draws, and what one of them gives
figures  NEES, NIS, spread against the bound, with confidence bands
======== ==========================================================================================
"""
