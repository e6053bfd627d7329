"""One file for each verb of the command line, with a function of the verb's name.

The docstring of the file ends with examples. ``GROUPS`` are functions whose options the command
line adds (`boresight.options`); ``typed`` returns arguments that differ there from Python's.
"""

from __future__ import annotations

#: What each verb is for.
VERBS = {
    "new": "Write a first estimator with its world, a log and a test.",
    "info": "Show installed and missing tools, an estimator's declarations, or a log's columns.",
    "compile": "Write a core for an FPGA: Verilog, test bench, instances, register map, C.",
    "check": "Compare integer model, C and RTL on logs, bit by bit, and with float64.",
    "run": "Run an estimator on a log, in a closed loop with a world, or on the simulated board.",
    "fit": "Choose the formats of values from runs of the estimator.",
    "explore": "Compare word widths, machines and parts.",
    "accuracy": "Measure errors against the truth of logs, beside published filters.",
    "tune": "Tune parameters on logs with true values, with cross-validation.",
    "montecarlo": "Run many random draws of a world: errors, NEES, NIS, spread against the bound.",
    "experiment": "Run a published experiment in simulation and judge its targets.",
    "monitor": "Read attitudes and registers of a board from its serial line.",
}
