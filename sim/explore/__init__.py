"""Many combinations of word, machine and target: cost and errors of each, and the choice.

======= ===========================================================================================
module  contents
======= ===========================================================================================
cases   the combinations
measure the work that each needs, by a digest of all its inputs: errors, cycles, area
table   a row of figures for each combination, demands on them, and the choice
page    the page of an exploration: a plot of error over cost, and the table
======= ===========================================================================================
"""
