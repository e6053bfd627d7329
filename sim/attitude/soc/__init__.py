"""The soft core in simulation: benches, and measurements of software estimators."""
