"""Many combinations of word, machine and target: cost and errors of each, and the choice.

======= ===========================================================================================
module  contents
======= ===========================================================================================
cases   the combinations, and the work that each needs, by a digest of all that decides its result
measure that work: errors, cycles, area
figures rows of the table, one for each combination, and its columns
demands demands on figures as text, the choice, and the nearest combination
page    the page on which the combinations are compared
======= ===========================================================================================
"""
