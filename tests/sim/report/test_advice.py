"""Advice on ranges: whoever follows it gains the bits that it promises."""

import dataclasses
import inspect
from typing import Any

import numpy as np
import pytest

import boresight.kalman as filters
from boresight.kalman import Kalman
from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report.advice import Advice, advice_of, wasted_bits
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.observed import Observed

N = 40


class Wide(Estimator):
    """Ranges that a log hardly uses; ``limits`` replace them."""

    limits: dict[str, tuple[float, float]] = {}
    params = (Param("gain", 0.5, 0.0, 64.0, ""),)
    outputs = (Output("twice", ""), Output("rest", ""), Output("kept", ""), Output("part", ""))

    def __init__(self, **limits: tuple[float, float]) -> None:
        def given(name: str, low: float, high: float) -> tuple[float, float]:
            return limits.get(name, (low, high))

        self.limits = limits
        self.inputs = (
            Input("u", *given("u", -1000.0, 1000.0), ""),
            Input("v", -1.0, 1.0, ""),
            Input("w", -1.0, 1.0, ""),
            Input("still", -1000.0, 1000.0, ""),
        )
        self.states = (State("y", *given("y", -128.0, 128.0), ""),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A product of what is wide, a difference that cancels, and a share of it."""
        rest = 8.0 * u.v - 8.0 * u.w
        if "rest" in self.limits:
            rest = ops.bounded(rest, *self.limits["rest"], "v and w are one")
        rest = ops.named("rest", rest)
        kept = ops.saturated(100.0 * u.v, self.limits.get("kept", (0.0, 64.0))[1])
        y = 0.5 * x.y + u.v + p.gain * u.still
        return {"y": y}, {"twice": 2.0 * u.u, "rest": rest, "kept": kept, "part": 0.5 * rest}


def observed(estimator: Estimator) -> Observed:
    """What small signals do."""
    wave = np.sin(0.7 * np.arange(N))
    columns = {"u": 3.0 * wave, "v": 0.1 * wave, "w": 0.099 * wave, "still": np.full(N, 0.25)}
    build = Build(estimator)
    (check,) = Check(build, levels=("fixed",)).run(Record.of(columns))
    return Observed.of(build.programs[0], [check])


@pytest.fixture(scope="module")
def wide() -> Observed:
    return observed(Wide())


def advice(result: Observed, name: str) -> Advice:
    made = advice_of(result, result.program.find(name))
    assert made is not None and made.value == name
    return made


@pytest.mark.parametrize("name", ["u", "y", "rest"])
def test_who_follows_gains_the_bits(name: str, wide: Observed) -> None:
    said = advice(wide, name)
    low, high = wide.reached(wide.program.find(name))
    assert said.gains > 0 and said.low < 2.0 * low and said.high > 2.0 * high
    after = observed(Wide(**{name: (said.low, said.high)}))
    value = after.program.find(name)
    fracs = wide.program.values[wide.program.find(name)].frac, after.program.values[value].frac
    assert fracs[1] - fracs[0] == said.gains
    assert not after.saturations(value)
    assert wasted_bits(after.headroom_bits(value)) == 0 and advice_of(after, value) is None


def test_what_to_write_and_where(wide: Observed) -> None:
    assert advice(wide, "u").how == 'Input("u", -7.992, 7.992, ...)'
    assert advice(wide, "y").how.startswith('State("y", -')
    assert advice(wide, "rest").how.startswith("ops.bounded(..., -")
    for name in ("u", "y", "rest"):
        assert advice(wide, name).line.startswith("test_advice.py, line ")
    assert len({advice(wide, name).line for name in ("u", "y", "rest")}) == 3


class Shared(Estimator):
    """A state that is measured: its input has the same name."""

    inputs = (Input("y", -1000.0, 1000.0, ""),)
    states = (State("y", -128.0, 128.0, ""),)
    outputs = (Output("y", "", tolerance=1.3e-7),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A share of the innovation."""
        y = x.y + 0.25 * (u.y - x.y)
        return {"y": y}, {"y": y}


def test_an_input_and_a_state_of_one_name() -> None:
    (check,) = Check(Build(Shared()), levels=("fixed",)).run(Record.of({"y": np.sin(np.arange(N))}))
    seen = Observed.of(check.build.programs[0], [check])
    rows = numerics_section(seen.program, seen)
    lines = {(row["kind"], row["signal"]): row["line"] for row in rows if row["kind"] != "op"}
    first = inspect.getsourcelines(Shared)[1]
    assert lines == {
        ("input", "y"): f"test_advice.py, line {first + 3}",
        ("state", "y"): f"test_advice.py, line {first + 4}",
    }
    assert advice_of(seen, seen.program.states[0][0]).how.startswith('State("y", ')  # type: ignore[union-attr]
    assert "from state y (test_advice.py" in check.accuracy.culprit


class Cart(Kalman):
    """A filter with wide ranges and large deviations; ``most`` replaces the position's."""

    inputs = (Input("z", -1000.0, 1000.0, "m"),)
    outputs = (Output("pos", "m"),)

    def __init__(self, most: float = 64.0) -> None:
        self.states = (
            filters.State("pos", -1024.0, 1024.0, "m", sd=2.0, sd_max=most),
            filters.State("vel", -64.0, 64.0, "m/s", sd=1.0, sd_max=8.0),
        )
        super().__init__()

    def f(self, x: Any, u: Any, p: Any) -> Any:
        """A step of time."""
        return {"pos": x.pos + 0.01 * x.vel}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        """Of the velocity."""
        return {"vel": 0.001}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        """The position."""
        return [filters.Measurement(u.z, x.pos, 1.0)]


def test_a_kalman_filters_handles_are_ranges_and_largest_deviations() -> None:
    def rows(cart: Cart) -> tuple[dict[str, Any], Observed]:
        given = Record.of({"z": np.sin(np.arange(N))})
        (check,) = Check(Build(cart), levels=("fixed",)).run(given)
        seen = Observed.of(check.build.programs[0], [check])
        return {r["signal"]: r for r in numerics_section(seen.program, seen)}, seen

    found, seen = rows(Cart())
    how = {name: row["advice"]["how"] for name, row in found.items() if row["advice"]}
    assert set(how) == {"z", "pos", "vel", "p_pos_pos", "p_vel_vel"}
    assert how["pos"].startswith('State("pos", -')
    assert how["p_pos_pos"].startswith('State("pos", ..., sd_max=')
    most = float(how["p_pos_pos"].partition("sd_max=")[2].rstrip(")"))
    after, finer = rows(Cart(most))
    gained = [s.program.values[s.program.find("p_pos_pos")].frac for s in (seen, finer)]
    assert gained[1] - gained[0] == found["p_pos_pos"]["advice"]["gains"]
    assert not after["p_pos_pos"]["saturations"]
    assert found["pos_next"]["unit"] == "m", "an output has the unit of its port"


def test_a_power_of_two_where_the_word_clamps(wide: Observed) -> None:
    value = wide.program.outputs[wide.program.output_names.index("kept")]
    said = advice_of(wide, value)
    assert said is not None and said.how == "ops.saturated(..., 32)" and said.gains == 1
    after = observed(Wide(kept=(-32.0, 32.0)))
    new = after.program.outputs[after.program.output_names.index("kept")]
    assert after.program.values[new].frac - wide.program.values[value].frac == said.gains


def test_no_advice_where_it_would_not_help(wide: Observed) -> None:
    program = wide.program
    outputs = dict(zip(program.output_names, program.outputs, strict=True))
    # Wide for its operands' sake: they have the advice.
    for name in ("twice", "part"):
        assert wasted_bits(wide.headroom_bits(outputs[name])) > 0
        assert advice_of(wide, outputs[name]) is None
    # Never moved; a parameter.
    assert wasted_bits(wide.headroom_bits(program.find("still"))) > 0
    for value in (program.find("still"), program.find("gain")):
        assert advice_of(wide, value) is None


def test_no_advice_where_the_format_is_not_that_of_the_range(wide: Observed) -> None:
    value, values = wide.program.find("u"), list(wide.program.values)
    values[value] = dataclasses.replace(values[value], low=-400.0, high=400.0)
    program = dataclasses.replace(wide.program, values=tuple(values))
    assert advice_of(dataclasses.replace(wide, program=program), value) is None


class Shapes(Estimator):
    """Operations that fill what their operands give them, in ranges that nothing fills."""

    inputs = (Input("a", 0.0, 100.0, ""), Input("b", 0.0, 100.0, ""), Input("c", -100.0, 100.0, ""))
    outputs = tuple(Output(n, "") for n in ("apart", "product", "chosen", "turned", "size"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Each once."""
        return {}, {
            "apart": u.a - u.b,
            "product": u.a * u.c,
            "chosen": ops.where(u.c < 0.0, u.a, 1.0 * u.b),
            "turned": ops.flip(u.c < 0.0, u.a),
            "size": ops.absolute(u.c),
        }


@pytest.mark.parametrize("name", [o.name for o in Shapes.outputs])
def test_what_its_operands_explain_has_no_advice(name: str) -> None:
    rng = np.random.default_rng(5)
    columns = {"a": rng.uniform(0.4, 0.5, N), "b": rng.uniform(0.4, 0.5, N)}
    columns["c"] = rng.uniform(-0.5, 0.5, N)
    build = Build(Shapes())
    (check,) = Check(build, levels=("fixed",)).run(Record.of(columns))
    result = Observed.of(build.programs[0], [check])
    value = result.program.outputs[result.program.output_names.index(name)]
    assert wasted_bits(result.headroom_bits(value)) > 0 and value in result.nodes
    assert advice_of(result, value) is None


@pytest.mark.parametrize(("headroom", "bits"), [(0.0, 0), (1.99, 0), (2.0, 1), (9.5, 8)])
def test_one_bit_stays_in_reserve(headroom: float, bits: int) -> None:
    assert wasted_bits(headroom) == bits
