"""Estimators written once, and everything between their equations and integers. numpy only.

| module | what |
|---|---|
| `ops`, `graph` | the operations, on float64 arrays or traced |
| `estimator`, `estimators` | what an estimator is; all of them |
| `lower`, `forms`, `groups`, `functions`, `tables` | from the traced graph to the program |
| `program`, `fixed` | the fixed-point program; its integer semantics |
| `interpreter` | runs programs in numpy |
| `attitude` | quaternions, matrices, Euler angles |

Frames, units, notation: `docs/conventions.md`.
"""
