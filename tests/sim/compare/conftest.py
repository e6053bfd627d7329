"""A small core with made-up synthesis results, and runs over a bundled log, for the report."""

import pytest

from boresight.gateware.core import Core, build_core
from boresight.model.attitude.complementary import Complementary
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.records.files import bundled, read_record

STEPS = 300


@pytest.fixture(scope="session")
def core() -> Core:
    return build_core(Complementary().compile(), "fast")


@pytest.fixture(scope="session")
def checked() -> CheckResult:
    """The interpreter and the C on a bundled log with truth."""
    build = Build(Complementary(), config="fast")
    record = read_record(bundled("synthetic_60s")).head(STEPS)
    (result,) = Check(build, levels=("fixed", "c")).run(record)
    return result
