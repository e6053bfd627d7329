"""Two-radar registration: Cui et al. (2014)."""
