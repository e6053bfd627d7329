"""Second-order sections, against scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal

from boresight.model.blocks import biquad
from boresight.model.blocks.biquad import Cascade
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, input_words
from boresight.model.words.interpreter import Interpreter

DESIGNS = {
    "butterworth": signal.butter(4, 0.1, output="sos"),
    "elliptic": signal.ellip(6, 0.5, 60.0, 0.3, output="sos"),
    "notch": signal.tf2sos(*signal.iirnotch(0.1, 30.0)),
    "slow": signal.butter(2, 0.02, output="sos"),
    "band": signal.butter(2, [0.2, 0.25], "band", output="sos"),
}


def _filter(cascade: Cascade) -> Estimator:
    class Filter(Estimator):
        """A cascade."""

        inputs = (Input("u", -2.0, 2.0, "V"),)
        states = cascade.states("s", "V")
        outputs = (Output("y", "V"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One sample."""
            after, y = cascade.step("s", x, u.u)
            return after, {"y": y}

    return Filter()


def _hostile(sos: Any, n: int) -> Any:
    """Noise, steps, and what drives the output as far as it goes."""
    rng = np.random.default_rng(3)
    response = signal.sosfilt(sos, np.eye(1, n // 2)[0])
    worst = np.sign(response[::-1])
    return 2.0 * np.concatenate(
        [rng.uniform(-1.0, 1.0, n // 4), worst, rng.choice([-1, 1], n // 4)]
    )


@pytest.mark.parametrize("word", [24, 32])
@pytest.mark.parametrize("name", DESIGNS)
def test_within_its_bounds_of_scipy(name: str, word: int) -> None:
    sos = DESIGNS[name]
    cascade = Cascade.of(sos, 2.0)
    estimator = _filter(cascade)
    program = estimator.compile(word=word)
    words = input_words(program, _hostile(sos, 2000)[:, None, None])
    out, saturated = Interpreter(program, 1).run(words)
    fmt = program.format(program.outputs[0])
    seen = program.format(program.inputs[0]).real(words[:, 0, 0])
    wanted = signal.sosfilt(sos, seen)
    floats = estimator.run_float(seen[:, None, None]).outputs["y"][:, 0]
    assert np.abs(floats - wanted).max() < 1e-9 and not saturated.any()
    # Its roundings, and those of the coefficients.
    apart = np.abs(fmt.real(out[:, 0, 0]) - wanted).max() / fmt.lsb
    assert 0.02 * cascade.rounding < apart < 1.5 * cascade.rounding + 20.0
    # The bound of the output is reached, and not passed.
    assert 0.98 < np.abs(wanted).max() / cascade.largest_values[-1] <= 1.0


def test_products_and_states() -> None:
    cascade = Cascade.of(DESIGNS["butterworth"], 2.0)
    program = _filter(cascade).compile()
    assert [len(op.terms) for op in program.ops] == [5, 5]
    assert [s.name for s in cascade.states("s")] == ["s0_1", "s0_2", "s1_1", "s1_2", "s2_1", "s2_2"]


def test_rows_are_divided_by_their_a0() -> None:
    assert Cascade.of([(2.0, 4.0, 6.0, 2.0, 1.0, 0.5)], 1.0).sections == (
        (1.0, 2.0, 3.0, 0.5, 0.25),
    )


@pytest.mark.parametrize(
    "rows, wanted",
    [
        ([], "a section or more, found 0"),
        ([(1.0, 2.0, 3.0)], r"rows b0, b1, b2, a0, a1, a2, found \[1"),
        ([(1.0, 2.0, np.nan, 1.0, 0.0, 0.0)], "rows b0, b1, b2, a0, a1, a2, found "),
        ([(1.0, 2.0, 3.0, 0.0, 0.0, 0.0)], "rows b0, b1, b2, a0, a1, a2, found "),
        ([(1.0, 2.0, 1.0, 1.0, -2.1, 1.05)], "poles inside the unit circle, found "),
        ([(1.0, 2.0, 1.0, 1.0, 0.0, 1.0)], "poles inside the unit circle, found "),
        ([(1.0, 2.0, 1.0, 1.0, 2.0, 0.9)], "poles inside the unit circle, found "),
    ],
)
def test_sections_that_are_none(rows: Any, wanted: str) -> None:
    with pytest.raises(InputError, match=rf"^test_biquad\.py, line \d+: wanted {wanted}"):
        Cascade.of(rows, 1.0)


def test_poles_without_a_bound_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sum that is cut off is no bound."""
    monkeypatch.setattr(biquad, "_MOST", 3000)
    near = Cascade.of([(1.0, 0.0, 0.0, 1.0, -1.9998, 0.99980001)], 1.0)
    with pytest.raises(InputError, match=r"^sections: wanted an impulse .* within 3,000 samples"):
        _ = near.largest_values
    assert Cascade.of(DESIGNS["slow"], 1.0).largest_values[-1] < 2.0
