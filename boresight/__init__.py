"""Boresight: estimators from equations to FPGA, proven equal bit by bit.

Every command of the command line is a function here::

    import boresight
    boresight.new("my_filter")
    boresight.list_estimators()
    boresight.compile("complementary", config="fast", output="build")
    boresight.run("complementary", "log.csv", on="fixed")
    boresight.check("complementary", "log.csv")
    boresight.report("complementary", "log.csv", output="build")
    boresight.accuracy("mekf", "folder", output="build")
    boresight.tune("complementary", "folder", output="params.json")
    boresight.explore("mekf", "log.csv", words=(18, 24, 32), output="build")
    boresight.experiment("ma2014", output="build")
    boresight.montecarlo("plant.py:Plant", "filter.py", runs=500, output="build")
    boresight.monitor("/dev/ttyUSB0", count=100, plot="attitude.png")
    boresight.simulate("mekf", seconds=1.0, output="build")
    boresight.simulate_world("plant.py:Plant", "pi.py", on="rtl")
    boresight.doctor()

An estimator is given as a name, ``file.py:Class``, a class or an object; an estimator's file needs
only ``from boresight import Estimator, Input, Output, Param, State, ops``. A log is given as a
path, or as data: arrays by column name, a table, a `Record`. Results are dataclasses: ``to_json()``
gives plain data, ``str`` what the command line prints, and a notebook shows tables and plots.
Importing this package is cheap: its modules are imported on the first use of their names.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if not os.path.isdir(os.path.join(__path__[0], "model")):  # a checkout without symbolic links
    __path__.append(os.path.dirname(__path__[0]))

if TYPE_CHECKING:
    from boresight.loop import LoopResult as LoopResult
    from boresight.loop import simulate_world as simulate_world
    from boresight.model import blocks as blocks
    from boresight.model import ops as ops
    from boresight.model.declarations import Input as Input
    from boresight.model.declarations import Output as Output
    from boresight.model.declarations import Param as Param
    from boresight.model.declarations import State as State
    from boresight.model.errors import InputError as InputError
    from boresight.model.errors import ToolMissing as ToolMissing
    from boresight.model.estimator import Estimator as Estimator
    from boresight.regression import baseline as baseline
    from boresight.results.compile import CompileResult as CompileResult
    from boresight.results.fit import FitResult as FitResult
    from boresight.sim.baseline import Baseline as Baseline
    from boresight.sim.compare.results import CheckResult as CheckResult
    from boresight.sim.experiments.experiment import Experiment as Experiment
    from boresight.sim.experiments.experiment import Result as Result
    from boresight.sim.experiments.experiment import Target as Target
    from boresight.sim.records.files import record_of as record_of
    from boresight.sim.records.record import Record as Record
    from boresight.sim.worlds.world import World as World
    from boresight.verbs.check import CheckResults as CheckResults
    from boresight.verbs.check import check as check
    from boresight.verbs.compile import compile as compile
    from boresight.verbs.convert import ConvertResult as ConvertResult
    from boresight.verbs.convert import convert as convert
    from boresight.verbs.demo import DemoResult as DemoResult
    from boresight.verbs.demo import demo as demo
    from boresight.verbs.doctor import DoctorResult as DoctorResult
    from boresight.verbs.doctor import doctor as doctor
    from boresight.verbs.experiment import ExperimentResult as ExperimentResult
    from boresight.verbs.experiment import experiment as experiment
    from boresight.verbs.explore import explore as explore
    from boresight.verbs.figures.accuracy import accuracy as accuracy
    from boresight.verbs.figures.bench import BenchResult as BenchResult
    from boresight.verbs.figures.bench import bench as bench
    from boresight.verbs.figures.montecarlo import montecarlo as montecarlo
    from boresight.verbs.figures.tune import tune as tune
    from boresight.verbs.fit import fit as fit
    from boresight.verbs.list import Catalogue as Catalogue
    from boresight.verbs.list import list_estimators as list_estimators
    from boresight.verbs.monitor import monitor as monitor
    from boresight.verbs.new import NewResult as NewResult
    from boresight.verbs.new import new as new
    from boresight.verbs.report import ReportResult as ReportResult
    from boresight.verbs.report import report as report
    from boresight.verbs.run import RunResult as RunResult
    from boresight.verbs.run import run as run
    from boresight.verbs.simulate import simulate as simulate
    from boresight.verbs.simulate import simulate_faults as simulate_faults
    from boresight.verbs.topics import TopicsResult as TopicsResult
    from boresight.verbs.topics import topics as topics

__version__ = "0.1.0"

#: The same names for Python, by the module that has them.
_EXPORTS = {
    "loop": "LoopResult simulate_world",
    "model": "blocks ops",
    "model.declarations": "Input Output Param State",
    "model.errors": "InputError ToolMissing",
    "model.estimator": "Estimator",
    "regression": "baseline",
    "results.compile": "CompileResult",
    "results.fit": "FitResult",
    "sim.baseline": "Baseline",
    "sim.compare.results": "CheckResult",
    "sim.experiments.experiment": "Experiment Result Target",
    "sim.records.files": "record_of",
    "sim.records.record": "Record",
    "sim.worlds.world": "World",
    "verbs.check": "CheckResults check",
    "verbs.compile": "compile",
    "verbs.convert": "ConvertResult convert",
    "verbs.topics": "TopicsResult topics",
    "verbs.demo": "DemoResult demo",
    "verbs.doctor": "DoctorResult doctor",
    "verbs.experiment": "ExperimentResult experiment",
    "verbs.figures.accuracy": "accuracy",
    "verbs.figures.bench": "BenchResult bench",
    "verbs.figures.montecarlo": "montecarlo",
    "verbs.figures.tune": "tune",
    "verbs.explore": "explore",
    "verbs.fit": "fit",
    "verbs.list": "Catalogue list_estimators",
    "verbs.monitor": "monitor",
    "verbs.new": "NewResult new",
    "verbs.report": "ReportResult report",
    "verbs.run": "RunResult run",
    "verbs.simulate": "simulate simulate_faults",
}
_MODULE_OF = {name: place for place, names in _EXPORTS.items() for name in names.split()}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    path = f"{__name__}.{_MODULE_OF[name]}"
    is_module = name in ("blocks", "ops")
    value = import_module(f"{path}.{name}") if is_module else getattr(import_module(path), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
