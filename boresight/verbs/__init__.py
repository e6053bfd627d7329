"""One file for each verb of the command line: its function, and `Verb`, what is typed of it.

The docstring of the file is its help: a line of what it is for, and examples.
"""

from __future__ import annotations

__all__ = ["VERBS"]

#: Where each verb is, below ``boresight``.
VERBS = {
    "new": "verbs.new",
    "list": "verbs.list",
    "compile": "verbs.compile",
    "fit": "verbs.fit",
    "run": "verbs.run",
    "check": "verbs.check",
    "report": "verbs.report",
    "explore": "verbs.explore",
    "tune": "verbs.figures.tune",
    "accuracy": "verbs.figures.accuracy",
    "convert": "verbs.convert",
    "topics": "verbs.topics",
    "experiment": "verbs.experiment",
    "demo": "verbs.demo",
    "bench": "verbs.figures.bench",
    "montecarlo": "verbs.figures.montecarlo",
    "monitor": "verbs.monitor",
    "simulate": "verbs.simulate",
    "doctor": "verbs.doctor",
}
