"""Boresight: attitude estimators from equations to FPGA, proven equal bit by bit.

Everything the command line does is one function here::

    import boresight
    boresight.list_estimators()
    boresight.compile("complementary", config="fast", output="build")
    boresight.run("complementary", "log.csv", on="fixed")
    boresight.check("complementary", "log.csv")
    boresight.report("complementary", "log.csv", output="build")
    boresight.accuracy("folder", output="build")
    boresight.tune("complementary", "folder", output="params.json")
    boresight.experiment("ma2014", output="build")
    boresight.covariance("mekf")
    boresight.monitor("/dev/ttyUSB0", count=100, plot="attitude.png")
    boresight.simulate("mekf", seconds=1.0, output="build")
    boresight.doctor()

Importing this package alone is cheap: a function's module is imported when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boresight.model.errors import InputError, ToolMissing
    from boresight.verbs.accuracy import accuracy
    from boresight.verbs.bench import bench
    from boresight.verbs.check import check
    from boresight.verbs.compile import compile
    from boresight.verbs.covariance import covariance
    from boresight.verbs.demo import demo
    from boresight.verbs.doctor import doctor
    from boresight.verbs.experiment import experiment
    from boresight.verbs.list import list_estimators
    from boresight.verbs.monitor import monitor
    from boresight.verbs.report import report
    from boresight.verbs.run import run
    from boresight.verbs.simulate import simulate, simulate_faults
    from boresight.verbs.tune import tune

__all__ = [
    "InputError",
    "ToolMissing",
    "accuracy",
    "bench",
    "check",
    "compile",
    "covariance",
    "demo",
    "doctor",
    "experiment",
    "list_estimators",
    "monitor",
    "report",
    "run",
    "simulate",
    "simulate_faults",
    "tune",
]

__version__ = "0.1.0"

#: Names whose module is not ``boresight.verbs.NAME``.
_ELSEWHERE = {
    "InputError": "model.errors",
    "ToolMissing": "model.errors",
    "list_estimators": "verbs.list",
    "simulate_faults": "verbs.simulate",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_ELSEWHERE.get(name, f'verbs.{name}')}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
