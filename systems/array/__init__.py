"""Attitude of an array that turns for eight hours: Wang Wenzhe et al. (2016)."""
