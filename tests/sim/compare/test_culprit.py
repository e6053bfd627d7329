"""The operation that is to blame, wherever in a run it stands."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.compare.diagnosis import _first_leaving
from boresight.sim.compare.twin import Traced, twins
from boresight.sim.levels.build import Build
from tests.support.faulty import HERE, All, Bounded, NegativeRoot, Root, Sine, Slow, Sums, look


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize(
    "estimator, inputs, step, text",
    [
        (Bounded, [0.0, 4.0, 4.0], 1, rf"step 1, value total {HERE}: saturates: 4\.5 does not fit "
         r"its range \[-2, 2\]; widen the range \(declared: by hand\) or limit the value"),
        (NegativeRoot, [1.0, 0.5, -2.0, -3.0], 2, rf"step 2, a bounded value in y_out {HERE}: "
         r"-2 does not fit its range \[0, 4\]; widen the range \(declared: hoped\)"),
        (Sine, [0.1, 0.5, 0.8], 2, rf"step 2, value y_out, an arc sine {HERE}: asin: argument "
         r"0\.8 is outside 0 to 0\.7188; limit the argument"),
        (Sine, [0.1, -0.5, 0.8], 1, rf"step 1, value y_out, an arc sine {HERE}: asin: argument "
         r"-0\.5 "),
        (Sums, [1.0, 2.0, 4.0, 0.0], 1, rf"step 1, value state y {HERE}: 1\.25 does not "
         r"fit its range \[-1, 1\]; widen the range \(declared\) or limit the value"),
        (Sums, [-4.0, -2.0, -4.0], 2, rf"step 2, value state y {HERE}: saturates: -2 does"),
    ],
)  # fmt: skip
def test_culprits(
    estimator: type[Estimator], inputs: list[float], step: int, text: str, word: int
) -> None:
    result = look(estimator(), inputs, word)
    assert result is not None and result.step == step
    assert re.match(text, str(result)), str(result)
    assert look(estimator(), inputs[:step], word) is None


@pytest.mark.parametrize(
    ("low", "high", "unit", "cure"),
    [
        (-1.0, 1.0, "ht", "an angle of a whole turn is wrapped: ops.wrap_ht"),
        (-0.5, 0.5, "turn", "an angle of a whole turn is wrapped: ops.wrap_turns"),
        (-0.25, 1.5, "ht", "widen the range (declared) or limit the value"),
        (-1.0, 1.0, "deg", "widen the range (declared) or limit the value"),
    ],
)
def test_an_angle_that_is_not_wrapped(low: float, high: float, unit: str, cure: str) -> None:
    class Turning(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        states = (State("a", low, high, unit),)
        outputs = (Output("a", unit),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            a = x.a + u.u
            return {"a": a}, {"a": a}

    assert str(look(Turning(), [0.5, 0.75, 0.75])).endswith(f"; {cure}")


@pytest.mark.parametrize(
    ("wrong", "kind"),
    [(lambda u: u.u * u.v, "a product"), (lambda u: u.u + 0.25 * u.v, "a sum"),
     (lambda u: ops.where(u.u < u.v, u.u, 0.5 * u.v), "a selection"),
     (lambda u: ops.absolute(u.u), "a magnitude"),
     (lambda u: ops.wrap_ht(u.u + u.v), "a wrapped angle")],
)  # fmt: skip
def test_a_word_that_is_wrong_by_itself(wrong: Any, kind: str) -> None:
    """No range explains it: both numbers are shown, in the first update in which they differ."""

    class Plain(Estimator):
        inputs = (Input("u", -1.0, 1.0), Input("v", -1.0, 1.0))
        outputs = (Output("y"), Output("z"))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": wrong(u), "z": ops.named("z", 0.3 * u.v)}

    build = Build(Plain())
    of = Traced.of(build, 0)
    program, nodes = of.program, of.nodes
    words = np.array([[3, 5], [-7, 11], [2, -9]]) << 26
    (twin,) = twins(of, words, np.zeros((3, 0), dtype=np.int64), first=40)
    assert _first_leaving(twin) is None
    y, z = program.outputs
    twin.words[z][2] += 1 << 20
    assert re.fullmatch(
        r"step 42, value z \(.*\): float64 has \S+ where.*", str(_first_leaving(twin))
    )
    twin.words[y][1] += 1 << 20
    exact, seen = twin.computed(nodes[y])[1], twin.real(y)[1]
    assert re.fullmatch(
        rf"step 41, value \w+, {kind} \(test_culprit\.py, line \d+\): float64 has {exact:.6g} "
        rf"where the word has {seen:.6g}; see the report",
        str(_first_leaving(twin)),
    ), str(_first_leaving(twin))


@pytest.mark.parametrize("word", [18, 32])
def test_which_distances_are_rounding(word: int) -> None:
    """64 last bits of a small product; a whole turn of an angle, half a turn not."""

    class Plain(Estimator):
        inputs = (Input("u", -1.0, 1.0), Input("v", -1.0, 1.0))
        outputs = (Output("product"), Output("angle", "ht"))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"product": u.u * u.v, "angle": ops.wrap_ht(u.v + u.v - 2.0**-40)}

    build = Build(Plain(), word=word)
    (program,) = build.programs
    inputs, states = np.array([[0, 1 << word - 3]] * 4), np.zeros((4, 0), dtype=np.int64)
    (twin,) = twins(Traced.of(build, 0), inputs, states)
    product, angle = program.outputs
    assert (twin.real(angle) == -1.0).all()  # where float64 has little less than 1
    twin.words[product] = twin.words[product] + [-65, -64, 64, 65]
    assert twin.leaves(product).tolist() == [True, False, False, True]
    twin.words[angle] = twin.words[angle] + [0, 1 << word - 1, 0, 0]
    assert twin.leaves(angle).tolist() == [False, True, False, False]
    assert twin.deviation(angle)[0] == pytest.approx([0.0, 1.0, 0.0, 0.0], abs=1e-9)


def test_below_the_floor_of_a_function() -> None:
    result = str(look(Root(), [1.0, 0.1, 1e-3]))
    assert re.match(rf"step 2, value y_out, a bounded value {HERE}: rsqrt: argument ", result)
    assert result.endswith(
        "e-08 of full scale is below the floor 2^-22; scale power up, or declare a narrower range "
        "than [0, 16]"
    )


@pytest.mark.parametrize("word", [18, 32])
def test_rounding_alone_has_no_culprit(word: int) -> None:
    inputs = np.random.default_rng(5).uniform(-4.0, 4.0, 300).tolist()
    assert look(All(), inputs, word) is None
    assert look(Slow(), inputs, word) is None


def test_a_limited_value_is_as_coarse_as_what_is_limited() -> None:
    """Its first step is not to blame for what rounding adds up."""

    class Leak(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        params = (Param("k", 5e-7, 0.0, 2.0**-10),)
        states = (State("x", -(2.0**-26), 2.0**-26 * (1.0 - 2.0**-31)),)
        outputs = (Output("x"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            after = ops.saturated(x.x + p.k * u.u, 2.0**-26)
            return {"x": after}, {"x": after}

    assert look(Leak(), list(1e-2 * np.sin(np.arange(60.0))), word=24) is None
