"""Monte-Carlo: many draws of a world on one estimator, and its consistency.

======== ==========================================================================================
module   contents
======== ==========================================================================================
campaign the draws, and the results of one of them
figures  NEES, NIS, spread against the bound, with confidence bands
======== ==========================================================================================
"""
