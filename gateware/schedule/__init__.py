"""Cycle, lane and registers of each operation of a program.

`slots` < `arrange`, `captures`, `copies`, `priorities` < `problem` < `list_pass` <
`scheduler`; `allocate` gives registers.
"""
