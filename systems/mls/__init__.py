"""The carrier's microwave landing-system array: Wang Ding et al. (2018)."""
