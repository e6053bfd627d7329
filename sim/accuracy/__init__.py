"""Errors of an estimator against truth, and parameters that reduce them.

========== =====================================================================================
module     what it holds
========== =====================================================================================
figures    the error of a run: one figure for each output in its unit; of an attitude, angles
trials     logs with a reference
scoring    the emitted C over fixed records, again and again with other parameters
search     a pattern search over parameters
tuning     search, cross-validation and sensitivities over records
covariance a filter's covariance under hostile input
========== =====================================================================================
"""
