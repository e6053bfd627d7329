"""Estimators written once, and everything between their equations and integers.

| room or module | what |
|---|---|
| `words` | fixed-point words: meaning, tables, programs, interpreter |
| `lowering` | from the traced graph to a program |
| `ops`, `declarations`, `estimator` | what an author of an estimator reads |
| `algebra` | quaternions, vectors, covariances |
| `estimators`, `front` | those that come along; programs that calibrate sensors |
| `resolve` | from a name or a file to an estimator |

Frames, units, notation: `docs/conventions.md`.
"""
