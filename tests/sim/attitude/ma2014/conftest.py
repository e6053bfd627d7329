"""The whole experiment, small, once for all of its tests."""

import pytest

from boresight.sim.attitude.ma2014.experiment import Ma2014
from boresight.sim.experiments.experiment import grouped


@pytest.fixture(scope="session")
def said():
    return []


@pytest.fixture(scope="session")
def result(said):
    return Ma2014().run(seed=5, runs=3, say=said.append)


@pytest.fixture(scope="session")
def data(result):
    return result.details


@pytest.fixture(scope="session")
def find():
    """``find(targets, name)``: those whose name begins so, of one source."""

    def look(targets, name):
        (group,) = (g for g in grouped(targets) if g[0].name.startswith(name))
        return group

    return look
