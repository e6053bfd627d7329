"""Shared by the tests of the experiment: one run of it, small."""

from __future__ import annotations

import pytest

from boresight.sim.experiments import ma2014


@pytest.fixture(scope="session")
def said():
    return []


@pytest.fixture(scope="session")
def data(said):
    return ma2014.run(seed=5, runs=3, progress=said.append)
