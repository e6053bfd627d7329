"""The soft core in simulation: a bench that drives it, and what is measured with it."""
