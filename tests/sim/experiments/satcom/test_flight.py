"""A fleet in closed loop is each vehicle in its own."""

import dataclasses

import numpy as np
import pytest

from boresight.model.estimators.satcom import Satcom
from boresight.sim.experiments.satcom.flight import fly
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.sim.worlds.satcom import Fleet, OnTheMove
from boresight.sim.worlds.satcom_drive import Drive, specification_drive


def short(seconds: float) -> Drive:
    d = specification_drive()
    cut = {f.name: getattr(d, f.name)[: round(seconds * 50)] for f in dataclasses.fields(d)}
    return Drive(**cut)


def test_a_fleet_is_its_vehicles() -> None:
    fleet = Fleet(short(6.0), (3, 8))
    flight = fly(fleet, Satcom(), {"adapt": 50.0})
    level = make_level("c", Build(Satcom(), params=[{"adapt": 50.0}]))
    world = OnTheMove()
    world.fleet = Fleet(short(6.0), (3,))
    loop = close_loop(world, Satcom(), level)
    assert flight.inputs == pytest.approx(loop.inputs, abs=1e-14) and flight.saturated == 0
    for k, axis in enumerate(("roll", "pitch", "heading")):
        assert flight.first[axis] == pytest.approx(loop.outputs[axis], abs=1e-8)
        error = 180.0 * ((loop.outputs[axis] - loop.truth[axis] + 1.0) % 2.0 - 1.0)
        assert flight.error[:, 0, k] == pytest.approx(error, abs=1e-6)
    assert (flight.error[100:, 0] != flight.error[100:, 1]).any(axis=0).all()
    assert flight.status[:, 0].tolist() == loop.outputs["status"].tolist()
    assert flight.bias[:, 0, 2] == pytest.approx(np.degrees(loop.outputs["bias_z"]))
    assert flight.loss_db.shape == (300, 2) and flight.loss_db[-1].max() < flight.loss_db[0].min()
    loop_error = 180.0 * ((loop.outputs["heading_pi"] - loop.truth["heading"] + 1.0) % 2.0 - 1.0)
    assert flight.error[:, 0, 3] == pytest.approx(loop_error, abs=1e-6)
