"""Cycle and lane of each operation of a program: search, registers, independent proof.

`slots` < `arrange`, `captures`, `copies`, `priorities` < `problem`, `state`, `list_pass` <
`search`; `allocate` and `state_quotas` give registers; `check` and `check_core` share no code with
the search.
"""
