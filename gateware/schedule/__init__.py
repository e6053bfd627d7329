"""Cycle, lane and registers of each operation of a program.

`slots` < `arrange`, `copies` < `problem` < `list_pass` < `scheduler`; `allocate` gives registers.
"""
