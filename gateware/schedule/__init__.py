"""When and where each operation of a program runs: search, registers, independent proof.

`slots` < `arrange`, `captures`, `copies`, `priorities` < `problem`, `state`, `list_pass` <
`search`; `allocate` and `state_rooms` give registers; `check` and `check_core` share no code with
the search.
"""
