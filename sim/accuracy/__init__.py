"""Errors of an estimator against truth, and parameters that reduce them.

========== =====================================================================================
module     what it holds
========== =====================================================================================
figures    the error of a run: one figure for each output in its unit; of an attitude, angles
trials     logs with a truth
runs       an estimator over logs, run and judged, again and again with other parameters
benchmark  every estimator on every log
page       the page of it
search     a pattern search over parameters
tuning     search, cross-validation and sensitivities over records
covariance which states form a filter's covariance
========== =====================================================================================
"""
