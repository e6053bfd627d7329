"""Errors of an estimator against truth, and parameters that reduce them."""
