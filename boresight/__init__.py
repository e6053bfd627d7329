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
    boresight.accuracy_protocol("short", "mekf,vqf_online", "folder", output="build")
    boresight.tune("complementary", "folder", output="params.json")
    boresight.experiment("ma2014", output="build")
    boresight.covariance("mekf")
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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boresight.board.simulated import BoardResult, FaultsResult
    from boresight.loop import LoopResult, simulate_world
    from boresight.model import blocks, ops
    from boresight.model.declarations import Input, Output, Param, State
    from boresight.model.errors import InputError, ToolMissing
    from boresight.model.estimator import Estimator
    from boresight.results.accuracy import AccuracyResult
    from boresight.results.compile import CompileResult
    from boresight.results.protocol import ProtocolResult
    from boresight.results.tune import TuneResult
    from boresight.sim.accuracy.covariance import CovarianceTrial
    from boresight.sim.compare.results import CheckResult
    from boresight.sim.experiments.experiment import Experiment, Result, Target
    from boresight.sim.records.files import record_of
    from boresight.sim.records.record import Record
    from boresight.sim.worlds.world import World
    from boresight.verbs.check import CheckResults, check
    from boresight.verbs.compile import compile
    from boresight.verbs.convert import ConvertResult, convert
    from boresight.verbs.demo import DemoResult, demo
    from boresight.verbs.doctor import DoctorResult, doctor
    from boresight.verbs.experiment import ExperimentResult, experiment
    from boresight.verbs.figures.accuracy import accuracy
    from boresight.verbs.figures.bench import BenchResult, bench
    from boresight.verbs.figures.covariance import covariance
    from boresight.verbs.figures.montecarlo import MonteCarloResult, montecarlo
    from boresight.verbs.figures.protocol import accuracy_protocol
    from boresight.verbs.figures.tune import tune
    from boresight.verbs.fit import fit
    from boresight.verbs.list import Catalogue, list_estimators
    from boresight.verbs.monitor import MonitorResult, monitor
    from boresight.verbs.new import NewResult, new
    from boresight.verbs.report import ReportResult, report
    from boresight.verbs.run import RunResult, run
    from boresight.verbs.simulate import simulate, simulate_faults

__all__ = [
    "AccuracyResult",
    "BenchResult",
    "BoardResult",
    "Catalogue",
    "CheckResult",
    "CheckResults",
    "CompileResult",
    "ConvertResult",
    "CovarianceTrial",
    "DemoResult",
    "DoctorResult",
    "Estimator",
    "Experiment",
    "ExperimentResult",
    "FaultsResult",
    "FitResult",
    "Input",
    "InputError",
    "LoopResult",
    "MonitorResult",
    "MonteCarloResult",
    "NewResult",
    "Output",
    "Param",
    "ProtocolResult",
    "Record",
    "ReportResult",
    "Result",
    "RunResult",
    "State",
    "Target",
    "ToolMissing",
    "TuneResult",
    "World",
    "accuracy",
    "accuracy_protocol",
    "bench",
    "blocks",
    "check",
    "compile",
    "convert",
    "covariance",
    "demo",
    "doctor",
    "experiment",
    "fit",
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

#: Modules of names that are not those of verbs.
_ELSEWHERE = {
    **dict.fromkeys(("Input", "Output", "Param", "State"), "model.declarations"),
    **dict.fromkeys(("InputError", "ToolMissing"), "model.errors"),
    **dict.fromkeys(("Experiment", "Result", "Target"), "sim.experiments.experiment"),
    "AccuracyResult": "results.accuracy",
    "BenchResult": "verbs.figures.bench",
    "BoardResult": "board.simulated",
    "Catalogue": "verbs.list",
    "CheckResult": "sim.compare.results",
    "CheckResults": "verbs.check",
    "CompileResult": "results.compile",
    "ConvertResult": "verbs.convert",
    "CovarianceTrial": "sim.accuracy.covariance",
    "DemoResult": "verbs.demo",
    "DoctorResult": "verbs.doctor",
    "ExperimentResult": "verbs.experiment",
    "FaultsResult": "board.simulated",
    "FitResult": "results.fit",
    "LoopResult": "loop",
    "MonitorResult": "verbs.monitor",
    "MonteCarloResult": "verbs.figures.montecarlo",
    "NewResult": "verbs.new",
    "ProtocolResult": "results.protocol",
    "ReportResult": "verbs.report",
    "RunResult": "verbs.run",
    "TuneResult": "results.tune",
    "Estimator": "model.estimator",
    "Record": "sim.records.record",
    "record_of": "sim.records.files",
    "World": "sim.worlds.world",
    "accuracy_protocol": "verbs.figures.protocol",
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
        module = _ELSEWHERE.get(name) or import_module(f"{__name__}.verbs").place_of(name)
        value = getattr(import_module(f"{__name__}.{module}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
