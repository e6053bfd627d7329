"""Many combinations of word, machine and target: cost and errors of each, and the choice.

======= ===========================================================================================
module  contents
======= ===========================================================================================
cases   the combinations
measure the work that each needs, by a digest of all its inputs: errors, cycles, area
table   a row of figures for each combination, demands on them, and the choice
======= ===========================================================================================
"""
