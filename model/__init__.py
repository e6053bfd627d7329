"""Estimators, written once, and everything from their equations to integers.

| room or module | what |
|---|---|
| `words` | fixed-point words: meaning, tables, programs, interpreter |
| `lowering` | from the traced graph to a program |
| `ops`, `declarations`, `estimator` | what authors of estimators use |
| `algebra` | quaternions, vectors, covariances |
| `attitude` | the attitude filters, and programs that calibrate their sensors |
| `resolve` | from a name or a file to an estimator |

Frames, units, notation: `docs/conventions.md`.
"""
