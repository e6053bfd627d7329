"""The claims of an estimator about ranges: proven by intervals, or tried by a directed search."""
