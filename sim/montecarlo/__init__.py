"""Monte-Carlo: many draws of a world on one estimator, and what they say of its honesty.

======== ==========================================================================================
module   what it holds
======== ==========================================================================================
campaign which draws, and what one of them gives
journal  what is done, on disk, so that an interrupted campaign goes on
deal     who runs them: this process, all cores, a Dask cluster
figures  NEES, NIS, spread against the bound, with confidence bands
======== ==========================================================================================
"""
