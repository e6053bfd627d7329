"""Mutants: small faults put into the code one at a time, to see whether a test notices each.

| module | what |
|---|---|
| `groups` | which files, and the tests of each |
| `edits` | what is changed: an edit of the text |
| `hardware`, `software` | the faults of Amaranth's idioms, and of plain Python |
| `equivalent` | mutants that change nothing that could be seen, with the reason |
| `trial` | one mutant in a copy of the tree |
| `campaign` | a sample, resumable, over several workers |
| `page` | what survived, to read |

``python -m tests.mutants --help``, or ``make mutants``.
"""
