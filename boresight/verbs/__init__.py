"""One file for each verb of the command line, with a function of the verb's name.

The docstring of the file ends with examples. ``GROUPS`` are groups of options that the command
line adds (`boresight.options`); ``typed`` returns arguments that differ there from Python's.
"""

from __future__ import annotations

__all__ = ["VERBS"]

#: What each verb is for.
VERBS = {
    "new": "Write an estimator to begin with, its world, a log and their test.",
    "info": "Show the tools that are here, an estimator's declarations, or a log's columns.",
    "compile": "Write a core for an FPGA: Verilog, bench, instances, register map, C.",
    "check": "Compare integer model, C and RTL on logs, bit by bit, and with float64.",
    "run": "Run an estimator on a log, in a closed loop with a world, or on the board.",
    "fit": "Choose the formats of an estimator's values from runs.",
    "explore": "Compare many combinations of word, machine and part.",
    "accuracy": "Measure errors from truth, beside published filters.",
    "tune": "Fit parameters to logs with truth, with cross-validation.",
    "montecarlo": "Run many draws of a world: errors, NEES, NIS, spread against the bound.",
    "experiment": "Run a published experiment in simulation and judge its targets.",
    "monitor": "Read attitudes and registers of a board from its serial line.",
}
