"""Estimators, written once, and everything from their equations to integers.

| room or module | what |
|---|---|
| `words` | fixed-point words: meaning, tables, programs, interpreter |
| `lowering` | from the traced graph to a program |
| `ops`, `declarations`, `estimator` | what authors of estimators use |
| `algebra` | quaternions, vectors, covariances |
| `estimators`, `front` | the shipped estimators; programs that calibrate sensors |
| `resolve` | from a name or a file to an estimator |

Frames, units, notation: `docs/conventions.md`.
"""
