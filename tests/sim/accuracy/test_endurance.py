"""A long run in pieces gives what one run of all records gives, and sees what goes wrong."""

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.accuracy.endurance import Endurance, endurance
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level


class Drifting(Estimator):
    """An angle that goes round, a heap beyond its word, a covariance that shrinks, bits."""

    inputs = (Input("z", -2.0, 2.0, "ht"),)
    states = (
        State("angle", -1.0, 1.0, "ht"),
        State("heap", -4.0, 4.0),
        State("p00", 0.0, 1.0, "", 0.9),
        State("p01", -1.0, 1.0, "", 0.1),
        State("p11", 0.0, 1.0, "", 0.5),
    )
    outputs = (Output("angle", "ht"), Output("variance"), Output("status", "bits"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        angle = ops.wrap_ht(x.angle + 0.3 * u.z)
        shrunk = {"p00": 0.999 * x.p00, "p01": 0.999 * x.p01, "p11": 0.999 * x.p11}
        status = ops.where(u.z > 1.0, 5.0, ops.where(u.z < -1.0, 4.0, 0.0))
        heap = 0.99 * x.heap + 1.0 * u.z
        return shrunk | {"angle": angle, "heap": heap}, {
            "angle": angle,
            "variance": x.p00,
            "status": status,
        }


BUILD = Build(Drifting(), word=24)
Z = np.random.default_rng(3).uniform(-2.0, 2.0, 700)


def run(*borders: int, z: np.ndarray = Z, **options: Any) -> Endurance:
    cuts = zip((0, *borders), (*borders, len(z)), strict=True)
    return endurance(BUILD, ({"z": z[a:b]} for a, b in cuts), **options)


@pytest.mark.parametrize("borders", [(), (1, 2, 333), (100, 499, 500, 501)])
def test_pieces_give_what_the_whole_gives(borders: tuple[int, ...]) -> None:
    found = run(*borders, first=5, every=7, compared=("angle", "variance"), watched=50)
    whole = make_level("c", BUILD).run_anew(Z[:, None])
    beside = make_level("float", BUILD).run_anew(Z[:, None])
    for name, values in whole.outputs.items():
        np.testing.assert_array_equal(found.outputs[name], values[5::7])
    assert found.records == 700 and whole.saturated is not None and whole.states is not None
    assert found.saturated == whole.saturated.sum() > 20
    for d in differences(Drifting.outputs[:2], whole.outputs, beside.outputs):
        assert found.most[d.output] == d.largest > 0.0
        assert found.square[d.output] == pytest.approx(d.rms**2, rel=1e-9)
    assert set(found.most) == {"angle", "variance"}
    assert found.most["angle"] < 1e-3  # though it goes round and round
    counts = np.zeros(32)
    counts[[0, 2]] = (Z > 1.0).sum(), (np.abs(Z) > 1.0).sum()
    np.testing.assert_array_equal(found.counts["status"], counts)
    p = covariance_of(Drifting()).of_words(BUILD.programs[0], whole.states[-1:])
    assert found.least_eigenvalue == pytest.approx(float(np.linalg.eigvalsh(p).min()))


def test_what_is_not_asked_for_is_not_there() -> None:
    found = run(300)
    assert (found.most, found.square, found.least_eigenvalue) == ({}, {}, np.inf)
    assert len(found.outputs["angle"]) == 700


def test_covariances_between_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that dips in the middle is seen where it is looked at often enough."""

    class Dips(Drifting):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            state, told = super().step(x, u, p)
            return state | {"p01": ops.where(u.z > 1.99, 0.8, 0.0)}, told

    z = np.zeros(200)
    z[100] = 2.0
    pieces = [{"z": z}]
    every, seldom = (endurance(Build(Dips()), pieces, watched=n).least_eigenvalue for n in (1, 90))
    assert every < 0.0 < seldom


def test_a_filter_without_covariance_has_none_to_watch() -> None:
    class Plain(Estimator):
        inputs, outputs = (Input("z", -2.0, 2.0),), (Output("y"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": u.z}

    with pytest.raises(InputError, match="wanted states that are a covariance"):
        endurance(Build(Plain()), [{"z": Z}], watched=5)
