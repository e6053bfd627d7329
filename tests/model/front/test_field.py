"""Calibration of a magnetometer: against a plain matrix, limits."""

import numpy as np
import pytest

from boresight.model.front.field import FIELD_LIMIT, CalibrateField

#: Roundings: three matrix elements times the span of the counts, the bias, the result.
BOUND = 3 * 65536 * 2.0**-33 + 3 * 2.0**-16 * 0.5 + 2.0**-23


@pytest.mark.parametrize("seed", range(4))
def test_hard_and_soft_iron(seed: int, draw, both) -> None:
    e = CalibrateField()
    params = draw(e, seed, 0.05)
    counts = np.random.default_rng(seed).integers(-32768, 32768, (60, 3)).astype(float)
    counts[0], counts[1] = -32768, 32767
    fl, fixed, _ = both(e, counts, params)
    m = np.array([[params[f"field_{r}{c}"] for c in "xyz"] for r in "xyz"])
    b = np.array([params[f"field_bias_{a}"] for a in "xyz"])
    wanted = np.clip((counts - b) @ m.T, -FIELD_LIMIT, FIELD_LIMIT)
    for out, bound in ((fl, 1e-9), (fixed, BOUND)):
        assert np.abs(np.stack([out[f"m{a}"] for a in "xyz"], axis=1) - wanted).max() < bound


def test_the_example_line_is_a_field_of_usual_strength(both) -> None:
    _, fixed, saturated = both(CalibrateField(), [[1256, -234, -1894]])
    strength = np.linalg.norm([fixed[f"m{a}"][0] for a in "xyz"])
    assert 40 < strength < 65
    assert not saturated


def test_far_beyond_clamps_without_a_flag(both) -> None:
    wild = {f"field_{a}{a}": 0.499 for a in "xyz"} | {f"field_bias_{a}": -32767.0 for a in "xyz"}
    _, fixed, saturated = both(CalibrateField(), [[32767] * 3, [-32768] * 3], wild)
    assert fixed["mx"][0] == FIELD_LIMIT - 2.0**-23
    assert abs(fixed["mx"][1] + 0.499) < 1e-4
    assert not saturated
