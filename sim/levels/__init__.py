"""Levels: one estimator in its forms, behind one protocol.

======== =========================================================================================
module   what it holds
======== =========================================================================================
build    what levels are made from: estimators in one core, and everything that decides their words
level    the protocol: `reset`, `step` for closed loops, `run` for records; what a run gives
floating float64 with numpy (the reference as written), and compiled from C
integer  the integer interpreter, and the emitted C
rtl      the core's Verilog, for records and for closed loops
registry levels by name, as found in the modules of this room
======== =========================================================================================
"""
