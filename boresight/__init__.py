"""Boresight: estimators and controllers from equations to an FPGA core and C.

Every verb of the command line is a function here::

    import boresight
    boresight.new("my_filter")
    boresight.compile("my_filter.py", config="fast", output="build")
    boresight.run("my_filter.py", "log.csv", levels="fixed")
    boresight.check("my_filter.py", "log.csv", output="build")
    boresight.fit("my_filter.py", "log.csv")
    boresight.explore("my_filter.py", "log.csv", words=(18, 24, 32), output="build")
    boresight.accuracy("my_filter.py", "folder")
    boresight.tune("my_filter.py", "folder", output="params.json")
    boresight.montecarlo("plant.py:Plant", "my_filter.py", runs=500, output="build")
    boresight.experiment("satcom", output="build")
    boresight.monitor("/dev/ttyUSB0", steps=100, output=["attitude.png"])
    boresight.info()

An estimator is given as a name, ``file.py:Class``, a class or an object; an estimator's file needs
only ``from boresight import Estimator, Input, Output, Param, State, ops``. A log is given as a
path, or as data: arrays by column name, a table, a `Record`. Every verb returns a
`boresight.Result`: ``result["name"]`` is a value, ``result.good`` the verdict,
``to_json()`` plain data, ``str`` what the command line prints and a notebook shows.
Importing this package is cheap: its modules are imported on the first use of their names.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if not os.path.isdir(os.path.join(__path__[0], "model")):  # a checkout without symbolic links
    __path__.append(os.path.dirname(__path__[0]))

from boresight.verbs import VERBS

if TYPE_CHECKING:
    from boresight.model import blocks as blocks
    from boresight.model import ops as ops
    from boresight.model.declarations import Input as Input
    from boresight.model.declarations import Output as Output
    from boresight.model.declarations import Param as Param
    from boresight.model.declarations import State as State
    from boresight.model.errors import InputError as InputError
    from boresight.model.errors import ToolMissing as ToolMissing
    from boresight.model.estimator import Estimator as Estimator
    from boresight.sim.experiments.experiment import Experiment as Experiment
    from boresight.sim.experiments.experiment import ExperimentResult as ExperimentResult
    from boresight.sim.experiments.experiment import Target as Target
    from boresight.sim.records.files import record_of as record_of
    from boresight.sim.records.record import Record as Record
    from boresight.sim.result import Result as Result
    from boresight.sim.result import baseline as baseline
    from boresight.sim.worlds.world import World as World
    from boresight.verbs.accuracy import accuracy as accuracy
    from boresight.verbs.check import check as check
    from boresight.verbs.compile import compile as compile
    from boresight.verbs.experiment import experiment as experiment
    from boresight.verbs.explore import explore as explore
    from boresight.verbs.fit import fit as fit
    from boresight.verbs.info import info as info
    from boresight.verbs.monitor import monitor as monitor
    from boresight.verbs.montecarlo import montecarlo as montecarlo
    from boresight.verbs.new import new as new
    from boresight.verbs.run import run as run
    from boresight.verbs.tune import tune as tune

__version__ = "0.1.0"

#: The same names for Python, by the module that has them.
_EXPORTS = {
    "model": "blocks ops",
    "model.declarations": "Input Output Param State",
    "model.errors": "InputError ToolMissing",
    "model.estimator": "Estimator",
    "sim.experiments.experiment": "Experiment ExperimentResult Target",
    "sim.records.files": "record_of",
    "sim.records.record": "Record",
    "sim.result": "Result baseline",
    "sim.worlds.world": "World",
}
_MODULE_OF = {name: place for place, names in _EXPORTS.items() for name in names.split()}
_MODULE_OF |= {verb: f"verbs.{verb}" for verb in VERBS}

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
