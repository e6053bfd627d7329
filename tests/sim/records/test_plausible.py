"""Warnings about values that cannot be what their unit says."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.estimator import Estimator, Input, Output
from boresight.model.estimators import estimator
from boresight.sim.records.bundled import bundled, bundled_names
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.records.plausible import warnings_of

pytestmark = pytest.mark.pythons


class Sensors(Estimator):
    """Triples between other inputs; a flag beside them."""

    inputs = (
        Input("gx", -999.0, 999.0, "rad/s"),
        Input("ax", -9999.0, 9999.0, "m/s^2"),
        Input("mx", -1e6, 1e6, "uT"),
        Input("gy", -999.0, 999.0, "rad/s"),
        Input("ay", -9999.0, 9999.0, "m/s^2"),
        Input("my", -1e6, 1e6, "uT"),
        Input("gz", -999.0, 999.0, "rad/s"),
        Input("az", -9999.0, 9999.0, "m/s^2"),
        Input("mz", -1e6, 1e6, "uT"),
        Input("new_z", 0.0, 1.0, "uT", valid_of="mz"),
        Input("spin", -999.0, 999.0, "rad/s"),
        Input("thrust", -999.0, 999.0, "m/s^2"),
        Input("dt", -0.25, 0.25, "s", clamp=True),
    )
    outputs = (Output("y"),)


def warned(rows: int = 3, new: np.ndarray | None = None, **values: float) -> tuple[str, ...]:
    inputs = np.zeros((rows, len(Sensors.inputs)))
    usual = {"ax": 6.0, "ay": 0.0, "az": 8.0, "mx": 30.0, "my": 40.0, "mz": 0.0, "thrust": 1.0}
    for k, declared in enumerate(Sensors.inputs):
        inputs[:, k] = {**usual, **values}.get(declared.name, 0.0)
    return warnings_of(Sensors(), inputs, np.ones(inputs.shape, bool) if new is None else new)


def test_nothing_is_odd() -> None:
    assert warned() == ()


@pytest.mark.parametrize(
    "values, text",
    [
        ({"gx": 6.0, "gz": 8.1}, "gx gy gz: typically 10.1 rad/s, which looks like deg/s"),
        ({"spin": -10.5}, "spin: typically 10.5 rad/s, which looks like deg/s"),
        ({"ax": 0.6, "az": 0.8}, "ax ay az: typically 1 m/s^2, which looks like g (g0 in a "
         "header)"),
        ({"ax": 600.0, "az": 800.0}, "ax ay az: typically 1e+03 m/s^2, which looks like mg (mg0 in "
         "a header)"),
        ({"mx": 0.3, "my": 0.4}, "mx my mz: typically 0.5 uT, which looks like gauss"),
        ({"mx": 300.0, "my": 400.0}, "mx my mz: typically 500 uT, which looks like milligauss"),
        ({"mx": 3e4, "my": 4e4}, "mx my mz: typically 5e+04 uT, which looks like nT"),
        ({"dt": 0.25}, "dt: at the end of its range in most rows; is t in seconds?"),
    ],
)  # fmt: skip
def test_odd(values: dict[str, float], text: str) -> None:
    assert warned(**values) == (text,)


@pytest.mark.parametrize(
    "values",
    [
        {"gx": 10.0},
        {"az": 0.0, "ax": 0.89},
        {"az": 0.0, "ax": 1.11},
        {"az": 0.0, "ax": 890.0},
        {"az": 0.0, "ax": 1110.0},
        {"my": 0.0, "mx": 0.14},
        {"my": 0.0, "mx": 1.1},
        {"my": 0.0, "mx": 149.0},
        {"my": 0.0, "mx": 1001.0},
        {"my": 0.0, "mx": 9999.0},
        {"dt": 0.2499},
    ],
)
def test_not_odd(values: dict[str, float]) -> None:
    assert warned(**values) == ()


def test_typical_is_the_median_of_new_samples() -> None:
    inputs = np.zeros((4, len(Sensors.inputs)))
    inputs[:, 1], inputs[:, 2] = 9.8, 50.0
    new = np.ones(inputs.shape, bool)
    inputs[0, 0] = 900.0  # one outlier of four
    assert warnings_of(Sensors(), inputs, new) == ()
    inputs[:2, 2], new[2:, 5] = 0.5, False  # my is not new there, so the field is not
    assert warnings_of(Sensors(), inputs, new) == (
        "mx my mz: 2 rows have some of them, not all",
        "mx my mz: typically 0.5 uT, which looks like gauss",
    )
    new[:, [2, 5]] = False
    assert warnings_of(Sensors(), inputs, new) == ("mx my mz: 4 rows have some of them, not all",)


def test_a_pair_of_axes_is_no_vector() -> None:
    class Pair(Estimator):
        inputs = tuple(Input(f"a{axis}", -20.0, 20.0, "m/s^2") for axis in "xy")
        outputs = (Output("y"),)

    for new in ([[True, True]], [[True, False]]):
        assert warnings_of(Pair(), np.array([[0.6, 0.8]]), np.array(new)) == ()


@pytest.mark.parametrize("name", bundled_names())
def test_bundled_logs_are_plausible(name: str) -> None:
    assert feed(estimator("mekf"), read_record(bundled(name))).warnings == ()
