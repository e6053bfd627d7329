"""Many combinations of word, machine and target: what each costs, how exact it is, which to take.

======= ===========================================================================================
module  what it holds
======= ===========================================================================================
cases   the combinations, and the work that each needs, by a key of what decides its result
measure that work: errors, cycles, area
figures rows of the table, one for each combination, and its columns
demands demands on figures as text, the choice, and what comes nearest
page    the page on which the combinations are compared
======= ===========================================================================================
"""
