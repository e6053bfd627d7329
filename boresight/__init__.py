"""Boresight: estimators from equations to FPGA, proven equal bit by bit.

Everything the command line does is one function here::

    import boresight
    boresight.new("my_filter")
    boresight.list_estimators()
    boresight.compile("complementary", config="fast", output="build")
    boresight.run("complementary", "log.csv", on="fixed")
    boresight.check("complementary", "log.csv")
    boresight.report("complementary", "log.csv", output="build")
    boresight.accuracy("folder", output="build")
    boresight.tune("complementary", "folder", output="params.json")
    boresight.experiment("ma2014", output="build")
    boresight.covariance("mekf")
    boresight.montecarlo("plant.py:Plant", "filter.py", runs=500, output="build")
    boresight.monitor("/dev/ttyUSB0", count=100, plot="attitude.png")
    boresight.simulate("mekf", seconds=1.0, output="build")
    boresight.simulate_world("plant.py:Plant", "pi.py", on="rtl")
    boresight.doctor()

What takes an estimator takes a name, ``file.py:Class``, a class or an object; a file of one's own
needs no more than ``from boresight import Estimator, Input, Output, Param, State, ops``. Importing
this package alone is cheap: a module is imported when something of it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boresight.loop import simulate_world
    from boresight.model import blocks, ops
    from boresight.model.declarations import Input, Output, Param, State
    from boresight.model.errors import InputError, ToolMissing
    from boresight.model.estimator import Estimator
    from boresight.sim.experiments.experiment import Experiment, Result, Target
    from boresight.sim.records.files import record_of
    from boresight.sim.records.record import Record
    from boresight.sim.worlds.world import World
    from boresight.verbs.check import check
    from boresight.verbs.compile import compile
    from boresight.verbs.convert import convert
    from boresight.verbs.demo import demo
    from boresight.verbs.doctor import doctor
    from boresight.verbs.experiment import experiment
    from boresight.verbs.figures.accuracy import accuracy
    from boresight.verbs.figures.bench import bench
    from boresight.verbs.figures.covariance import covariance
    from boresight.verbs.figures.montecarlo import montecarlo
    from boresight.verbs.figures.tune import tune
    from boresight.verbs.list import list_estimators
    from boresight.verbs.monitor import monitor
    from boresight.verbs.new import new
    from boresight.verbs.report import report
    from boresight.verbs.run import run
    from boresight.verbs.simulate import simulate, simulate_faults

__all__ = [
    "Estimator",
    "Experiment",
    "Input",
    "InputError",
    "Output",
    "Param",
    "Record",
    "Result",
    "State",
    "Target",
    "ToolMissing",
    "World",
    "accuracy",
    "bench",
    "blocks",
    "check",
    "compile",
    "convert",
    "covariance",
    "demo",
    "doctor",
    "experiment",
    "list_estimators",
    "monitor",
    "montecarlo",
    "new",
    "ops",
    "record_of",
    "report",
    "run",
    "simulate",
    "simulate_faults",
    "simulate_world",
    "tune",
]

__version__ = "0.1.0"

#: Where names are that are no verb's.
_ELSEWHERE = {
    **dict.fromkeys(("Input", "Output", "Param", "State"), "model.declarations"),
    **dict.fromkeys(("InputError", "ToolMissing"), "model.errors"),
    **dict.fromkeys(("Experiment", "Result", "Target"), "sim.experiments.experiment"),
    "Estimator": "model.estimator",
    "Record": "sim.records.record",
    "record_of": "sim.records.files",
    "World": "sim.worlds.world",
    "list_estimators": "verbs.list",
    "simulate_faults": "verbs.simulate",
    "simulate_world": "loop",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name in ("blocks", "ops"):
        value = import_module(f"{__name__}.model.{name}")
    else:
        place = _ELSEWHERE.get(name) or import_module(f"{__name__}.verbs").place_of(name)
        value = getattr(import_module(f"{__name__}.{place}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
