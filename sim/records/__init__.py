"""Records: what an estimator is fed with, sample by sample, and what the truth was.

========= =======================================================================================
module    what it holds
========= =======================================================================================
record    a table of columns by name, with units, validity and a place for messages
units     from one unit to another
text      CSV: parsed with every fault named by line and column
archive   ``.npz`` archives, the nine-axis form included
feed      a record as an estimator's inputs: units, steps, true values
reader    the input reader of logs, loops and streams: missing samples, flags, ranges
plausible warnings in words about values that cannot be what their unit says
========= =======================================================================================
"""
