"""Levels: one estimator in its forms, behind one protocol.

======== =========================================================================================
module   contents
======== =========================================================================================
build    builds: estimators in one core, and everything that affects their words
level    the protocol: `reset`, `step` for closed loops, `run` for records; results of a run
floating float64 with numpy (the reference as written), and compiled from C
integer  the integer interpreter, and the emitted C
rtl      the core's Verilog, for records and for closed loops
registry levels by name
======== =========================================================================================
"""
