"""Comparisons: levels with the interpreter, outputs with float64 or truth, each with a verdict.

========== ======================================================================================
module     what it holds
========== ======================================================================================
check      every level on the same records, and fixed point against float64
results    a verdict for each level, and all of them for one estimator on one record
difference one output against its reference: largest and rms, where, within its tolerance or not
verdict    differences, saturations, ranges that were left, and what went wrong first
twin       every operation in float64 from the words that it reads
diagnosis  the first value that leaves its float twin, values that waste bits, their cures
claims     claims of `ops.bounded` and ranges of states: proven, checked or broken
soundness  what is refused before anything runs
textbook   float64 beside a second form of the same equations
========== ======================================================================================
"""
