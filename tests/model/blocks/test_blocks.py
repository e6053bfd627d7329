"""Building blocks: biquads, moving windows, tables."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import signal

from boresight.model import blocks
from boresight.model.blocks import Cascade, MovingSum, interpolated
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, input_words
from boresight.model.words.interpreter import Interpreter
from tests.support.compiled_float import numpy_float

# -- second-order sections, against scipy ---------------------------------------------------------

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
    floats = numpy_float(estimator, seen[:, None, None])["y"][:, 0]
    assert np.abs(floats - wanted).max() < 1e-9 and not saturated.any()
    # Its roundings, and those of the coefficients.
    error = np.abs(fmt.real(out[:, 0, 0]) - wanted).max() / fmt.lsb
    assert 0.02 * cascade.rounding < error < 1.5 * cascade.rounding + 20.0
    # The bound of the output is reached, and not passed.
    assert 0.98 < np.abs(wanted).max() / cascade.largest_values[-1] <= 1.0


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
    with pytest.raises(InputError, match=rf"^test_blocks\.py, line \d+: wanted {wanted}"):
        Cascade.of(rows, 1.0)


def test_poles_without_a_bound_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sum that is cut off is no bound."""
    monkeypatch.setattr(blocks, "_MOST", 3000)
    near = Cascade.of([(1.0, 0.0, 0.0, 1.0, -1.9998, 0.99980001)], 1.0)
    with pytest.raises(InputError, match=r"^sections: wanted an impulse .* within 3,000 samples"):
        _ = near.largest_values
    assert Cascade.of(DESIGNS["slow"], 1.0).largest_values[-1] < 2.0


# -- sums over a window: exact, and nothing drifts ------------------------------------------------

WINDOW = MovingSum(5, -3.0, 2.0)


class Mean(Estimator):
    """Mean of five samples, and their sum."""

    inputs = (Input("u", -3.0, 2.0, "V"),)
    states = WINDOW.states("u", "V")
    outputs = (Output("mean", "V"), Output("sum", "V"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One sample."""
        after, total = WINDOW.step("u", x, u.u)
        return after, {"mean": 0.2 * total, "sum": total}


@pytest.mark.parametrize("word", [18, 32])
def test_the_sum_of_the_last_samples(word: int) -> None:
    program = Mean().compile(word=word)
    samples = np.random.default_rng(1).uniform(-3.0, 2.0, (400, 1, 1))
    words = input_words(program, samples)
    out, saturated = Interpreter(program, 1).run(words)
    mean, total = (program.format(n).real(out[:, k, 0]) for k, n in enumerate(program.outputs))
    seen = program.format(program.inputs[0]).real(words[:, 0, 0])
    wanted = np.convolve(seen, np.ones(5))[:400]
    lsb = program.format(program.outputs[1]).lsb
    assert not saturated.any() and np.abs(total - wanted).max() <= 0.5 * lsb  # rounded once
    assert np.abs(mean - 0.2 * wanted).max() <= 2.0 * program.format(program.outputs[0]).lsb
    floats = numpy_float(Mean(), seen.reshape(-1, 1, 1))["sum"][:, 0]
    assert np.abs(floats - wanted).max() < 1e-14


def test_plain_floats_are_added_from_the_left() -> None:
    """The built-in `sum` gives 1.0 from Python 3.12 on."""
    window = MovingSum(10, 0.0, 1.0)
    held = SimpleNamespace(**{s.name: 0.1 for s in window.states("u")})
    assert window.step("u", held, 0.1)[1] == 0.9999999999999999


# -- interpolation in a table, against numpy ------------------------------------------------------

TABLES = {
    "two": ((-1.0, 3.0), (5.0, 4.0)),
    "uneven": ((0.0, 1.0, 2.0, 4.0), (0.0, 1.0, 0.5, 3.0)),
    "waves": (np.linspace(-1.0, 1.0, 17), np.sin(9.0 * np.linspace(-1.0, 1.0, 17))),
    "up to the last word": ((0.0, 1.65), (-0.9, 1.0 - 2.0**-31)),
    "steep": ((-2.0, -1.999, 1.3), (5.0, -5.0, 100.0)),
}


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize("name", TABLES)
def test_as_numpy_interpolates(trace: Any, name: str, word: int) -> None:
    points, values = TABLES[name]
    low, high = points[0] - 1.0, points[-1] + 0.5
    t = trace(lambda x: interpolated(x, points, values), [(low, high)], word)
    x = np.concatenate([np.random.default_rng(word).uniform(low, high, 2000), points])
    fixed, floats, saturated = t.run(x)
    seen = t.program.format(t.program.inputs[0])
    wanted = np.interp(seen.real(seen.quantise(x)), points, values)
    assert np.allclose(floats[0], wanted, rtol=0.0, atol=1e-10) and not saturated.any()
    steepest = np.abs(np.diff(values) / np.diff(points)).max()
    assert np.abs(fixed[0] - wanted).max() < 2.0 * t.formats()[0].lsb + 3.0 * steepest * seen.lsb
    assert (t.nodes[0].kind, t.nodes[0].data[2]) == ("bounded", "values of the table")


def test_points_above_the_range_cost_nothing(trace: Any) -> None:
    points, values = TABLES["waves"]
    costs = [
        len(trace(lambda x: interpolated(x, points, values), [r]).program.ops)
        for r in ((-1.0, 1.0), (-1.0, -0.9))
    ]
    assert costs[0] > 25 and costs[1] <= 3


@pytest.mark.parametrize(
    "points, values, reason",
    [
        ((0.0, 1.0), (1.0,), r"as many values as points, found \(2, 1\)"),
        ((0.0,), (1.0,), r"as many values as points, found \(1, 1\)"),
        ((0.0, 1.0, 1.0), (1.0, 2.0, 3.0), "finite points that rise, found "),
        ((0.0, 1.0), (1.0, np.nan), "finite points that rise, found "),
    ],
)
def test_tables_that_are_none(points: Any, values: Any, reason: str) -> None:
    with pytest.raises(InputError, match=rf"^test_blocks\.py, line \d+: wanted {reason}"):
        interpolated(0.5, points, values)
