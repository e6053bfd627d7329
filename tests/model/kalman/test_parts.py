"""Prediction and update as programs of their own, which share states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.kalman import Kalman, Measurement, State
from boresight.model.declarations import Input
from boresight.model.errors import InputError
from boresight.model.step import Values
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from tests.support.random_kalman import Drawn, inputs_of


class Motion(Drawn):
    part = "predict"


class Row(Drawn):
    part, shares = "update", "motion"


@pytest.mark.parametrize("seed", range(8))
def test_one_after_the_other_they_are_the_filter(seed: int) -> None:
    whole, parts = Drawn(seed), (Motion(seed), Row(seed))
    records = inputs_of(whole, 20)
    together = whole.run_float(records[:, :, None]).outputs
    p = Values("parameter", whole.param_values())
    state = {s.name: np.float64(s.initial) for s in whole.states}
    for k, record in enumerate(records):
        names = (i.name for i in whole.inputs)
        u = Values("input", dict(zip(names, record, strict=True)))
        for part in parts:
            state, out = part.step(Values("state", state), u, p)
        wanted = {name: values[k, 0] for name, values in together.items()}
        assert out == pytest.approx(wanted, rel=1e-12, abs=1e-12), (seed, k)


@pytest.mark.parametrize(
    ("seed", "levels"),
    [
        (1, ("fixed", "c")),
        *(pytest.param(s, ("fixed", "c", "rtl"), marks=pytest.mark.soak) for s in range(20)),
    ],
)
def test_in_one_core_they_are_equal_on_every_level(seed: int, levels: tuple[str, ...]) -> None:
    parts = [Row(seed), Motion(seed)]
    values = inputs_of(parts[0], 60)
    columns = {i.name: values[:, k] for k, i in enumerate(parts[0].inputs)}
    build = Build(*parts, config="small-1024")
    results = Check(build, levels=levels).run(Record.of(columns))
    assert all(result.exact for result in results), (seed, [x.lines() for x in results])


class Falling(Kalman):
    inputs = (Input("z", -8.0, 8.0),)
    states = (State("x", -8.0, 8.0, sd=0.5),)
    part = "predict"

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": 0.5 * x.x + 0.125 * u.z}


def test_what_a_part_needs() -> None:
    """A prediction has no measurement; an update does. Neither has a textbook of its own."""
    falling = Falling()
    assert falling.compile().ops and falling.textbook(np.zeros((1, 1))) is None
    falling.part = "update"
    with pytest.raises(InputError, match=r"estimator falling: wanted a method measure"):
        falling.compile()
    falling.part = "smooth"
    with pytest.raises(InputError, match="part: wanted one of predict, update, found 'smooth'"):
        falling.compile()


def test_an_update_leaves_what_no_measurement_shows() -> None:
    """No motion, no noise, no floor: with a gain of zero P stays as it is."""

    class Seen(Falling):
        part = "update"

        def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
            return [Measurement(u.z, x.x, 1.0, valid=u.z > 4.0)]

    seen = Seen()
    state = {s.name: np.float64(s.initial) for s in seen.states}
    for z, same in ((1.0, True), (5.0, False)):
        after, _ = seen.step(Values("state", state), Values("input", {"z": z}), None)
        assert (after == state) is same
