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
"""

from __future__ import annotations

from boresight.accuracy import accuracy
from boresight.bench import bench
from boresight.compiling import compile
from boresight.covariance import covariance
from boresight.demo import demo
from boresight.doctor import doctor
from boresight.experiment import experiment
from boresight.listing import list_estimators
from boresight.monitor import monitor
from boresight.proving import check
from boresight.reporting import report
from boresight.running import run
from boresight.simulate import simulate, simulate_faults
from boresight.tuning import tune
from model.errors import InputError, ToolMissing

__all__ = ["InputError", "ToolMissing", "accuracy", "bench", "check", "compile",
           "covariance", "demo", "doctor", "experiment", "list_estimators", "monitor", "report",
           "run", "simulate", "simulate_faults", "tune"]

__version__ = "0.1.0"
