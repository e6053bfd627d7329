"""Comparisons: outputs against float or truth, in their units, each with a verdict.

========== ======================================================================================
module     what it holds
========== ======================================================================================
difference one output against its reference: largest and rms, where, within its tolerance or not
culprit    the first value of a program that leaves its float twin, and what would cure it
========== ======================================================================================
"""
