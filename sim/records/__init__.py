"""Records: the inputs of an estimator, sample by sample, and true values.

========= =======================================================================================
module    contents
========= =======================================================================================
record    a table of columns by name, with units, validity and locations for messages
units     conversion of units
text      CSV, with faults named by line and column
columnar  Parquet, Feather, MAT, packed CSV; fast CSV by pyarrow
topics    topics of a recording, and their clocks
ulog      PX4's flight logs
bags      bags of ROS, MCAP
maps      which topics and fields become which columns, in TOML
frames    axes by their letters
assembly  a recording's topics as one record
selection slices, every n-th row, gaps
stream    logs of any length in pieces
archive   ``.npz`` archives, the nine-axis form included
feed      a record as an estimator's inputs: units, steps, true values
reader    the input reader of logs, loops and streams: missing samples, flags, ranges
plausible warnings about values that are implausible in their unit
========= =======================================================================================
"""
