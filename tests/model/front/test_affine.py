"""What the calibrations share, on plain numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from boresight.model.front.affine import IDENTITY, counts, matrix_params, rows, vector_params


def test_counts_are_the_words_of_the_sensors() -> None:
    assert [(i.name, i.low, i.high, i.unit) for i in counts("a", "b", unit="lsb")] == [
        ("a", -32768.0, 32767.0, "lsb"),
        ("b", -32768.0, 32767.0, "lsb"),
    ]


def test_a_matrix_is_a_scaled_identity_by_default() -> None:
    params = matrix_params("gyr", 0.5, 2.0, "rad/s", "rate")
    assert [p.name for p in params] == [f"gyr_{r}{c}" for r in "xyz" for c in "xyz"]
    defaults = np.reshape([p.default for p in params], (3, 3))
    np.testing.assert_array_equal(defaults, 0.5 * np.array(IDENTITY))
    assert {(p.low, p.high, p.unit) for p in params} == {(-2.0, 2.0, "rad/s")}
    assert params[1].meaning == "rate: body axis x from sensor axis y"


def test_a_vector_is_zero_by_default() -> None:
    params = vector_params("bias", 3.0, "uT", "hard iron")
    assert [(p.name, p.default, p.low, p.high, p.unit) for p in params] == [
        (f"bias_{a}", 0.0, -3.0, 3.0, "uT") for a in "xyz"
    ]
    assert params[2].meaning == "hard iron, axis z"


@pytest.mark.parametrize("bias", [None, "b"])
def test_rows_are_the_product_less_the_bias_clamped(bias) -> None:
    matrix = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, 6.0], [7.0, 8.0, -90.0]])
    offset, vector = np.array([0.25, -0.5, 1.0]), [1.0, 0.5, 2.0]
    names = {f"m_{r}{c}": matrix[i, j] for i, r in enumerate("xyz") for j, c in enumerate("xyz")}
    p = SimpleNamespace(**names, **{f"b_{a}": offset[i] for i, a in enumerate("xyz")})
    wanted = matrix @ vector - (offset if bias else 0.0)
    assert wanted[2] < -16.0
    assert rows(p, "m", vector, 16.0, bias=bias) == pytest.approx(np.clip(wanted, -16.0, 16.0))
