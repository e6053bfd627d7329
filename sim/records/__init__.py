"""Records: the inputs of an estimator, sample by sample, and true values.

========== =======================================================================================
module     contents
========== =======================================================================================
record     a table of columns by name, with units, validity and locations for messages
text       CSV, with faults named by line and column
tables     Parquet, Feather, MAT, ``.npz``
recordings PX4's flight logs, bags of ROS, MCAP; which topics become which columns, in TOML
assembly   a recording's topics as one record, and their clocks
selection  slices, every n-th row, gaps
files      log files by suffix; a log in blocks, as often as wanted; the bundled logs
feed       a record as an estimator's inputs: units, steps, true values
reader     the input reader of logs, loops and streams: missing samples, flags, ranges
plausible  warnings about values that are implausible in their unit
turning    warnings about rates, force, field and attitude that contradict one another
========== =======================================================================================
"""
