"""The soft core in simulation: filters in software, and updates of the core over the bus.

========== ==================================================
module     contents
========== ==================================================
measure    outputs and cycles of a filter in C
comparison float C, integer C and the core beside each other
offload    the attitude system's updates in the program
========== ==================================================
"""
