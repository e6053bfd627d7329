"""What limits an output: shares of its error, against what words of more bits do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.compare import influence as module
from boresight.sim.compare.influence import Influence, influences
from boresight.sim.compare.twin import rounding_errors
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted, words_of

N = 1200
T = np.arange(N)


class Coarse(Estimator):
    """A coarse product into a low pass, beside a fine one that hardly counts."""

    inputs = (Input("a", -1.0, 1.0), Input("b", -1000.0, 1000.0))
    states = (State("mean", -4.0, 4.0),)
    outputs = (Output("mean"), Output("fine"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        coarse = u.a * u.b  # its last bit is 2^-13 in a word of 24 bits
        fine = u.a * u.a
        mean = 0.9 * x.mean + 0.05 * coarse * u.a + 0.1 * fine
        return {"mean": mean}, {"mean": mean, "fine": fine}


class Functions(Estimator):
    """Kinds of nodes, each in an output of its own."""

    inputs = (Input("a", 0.25, 0.65), Input("b", -1.0, 1.0), Input("d", 0.0, 1.0))
    outputs = tuple(
        Output(n)
        for n in ("choice", "sin", "asin", "root", "ratio", "abs", "clip", "angle", "flip")
    )

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Each of a rounded product."""
        c = u.a * u.a
        limited = ops.saturated(4.0 * u.a * u.b, 1.0)
        return {}, {
            "sin": ops.sincos_ht(c)[0],
            "asin": ops.asin_ht(c),
            "root": ops.sqrt(c),
            "ratio": 1.0 / c,
            "abs": ops.where(u.b < 0.0, abs(u.b) * c, c),
            "clip": limited * c,
            "angle": ops.wrap_ht(c * 3.0),
            "choice": ops.where(u.d < 0.5, c, u.a),
            "flip": ops.flip(u.d < 0.5, c) + c,
        }


class Late(Estimator):
    """An output, and the same one update later by way of a wide state."""

    inputs = (Input("u", -1.0, 1.0),)
    states = (State("s", -63.0, 63.0),)
    outputs = (Output("now"), Output("late"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        now = 0.3 * u.u * u.u
        return {"s": now}, {"now": now, "late": 0.5 * x.s}


def found(
    estimator: Estimator, inputs: np.ndarray, word: int
) -> tuple[dict[str, list[Influence]], Any]:
    build = Build(estimator, word=word)
    run, (program,) = Emitted(build).run_anew(inputs), build.programs
    reference = CompiledFloat(build).run_anew(inputs).outputs
    assert run.states is not None
    got = influences(program, build.nodes[0], words_of(program, inputs), run.states)
    return got, {n: run.outputs[n] - reference[n] for n in run.outputs}


def exact(values: np.ndarray, steps: float = 64.0) -> np.ndarray:
    """Inputs that words of 18 bits hold, in steps of the unit."""
    return np.round(values * steps) / steps


def test_the_coarse_value_makes_the_error() -> None:
    inputs = np.stack([exact(np.sin(T)), exact(30.0 * np.cos(0.7 * T))], axis=1)
    got, deviation = found(Coarse(), inputs, 24)
    first = got["mean"][0]
    assert first.line.startswith("test_influence.py, line ") and first.share > 0.5
    whole = np.sqrt(sum(i.rms**2 for i in got["mean"]))
    assert whole == pytest.approx(np.std(deviation["mean"]), rel=0.1)
    assert first.one_more_bit == pytest.approx(whole * np.sqrt(1.0 - 0.75 * first.share), rel=1e-9)
    assert sum(i.share for i in got["mean"]) == pytest.approx(1.0)
    shares = [i.share for i in got["mean"]]
    assert shares == sorted(shares, reverse=True)
    assert first.value not in [i.value for i in got["fine"]]


def test_derivatives_of_every_kind() -> None:
    """The sum over values is the error that is there, within what chance does.

    Copies of the product in other formats count where they are read.
    """
    columns = [0.45 + 0.2 * np.sin(T), np.cos(1.3 * T), np.where(T % 3, 0.5, 0.25)]
    inputs = exact(np.stack(columns, axis=1), 2.0**16)
    got, deviation = found(Functions(), inputs, 18)
    for name, error in deviation.items():
        whole = np.sqrt(sum(i.rms**2 for i in got[name]))
        assert whole == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.15), name


def test_what_is_chosen_counts_where_it_is_chosen() -> None:
    class Chosen(Estimator):
        """In every fourth update a coarse product, else an input."""

        inputs = (Input("a", -1.0, 1.0), Input("b", -1000.0, 1000.0), Input("d", 0.0, 1.0))
        outputs = (Output("y"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            coarse = ops.clip(0.02 * (u.a * u.b), -1.0, 1.0)
            return {}, {"y": ops.where(u.d < 0.5, coarse, u.a)}

    columns = [exact(np.sin(T)), exact(30.0 * np.cos(0.7 * T)), np.where(T % 4, 0.75, 0.25)]
    got, deviation = found(Chosen(), np.stack(columns, axis=1), 18)
    whole = np.sqrt(sum(i.rms**2 for i in got["y"]))
    assert whole == pytest.approx(np.sqrt(np.mean(deviation["y"] ** 2)), rel=0.15)


def test_what_a_state_keeps_counts_in_later_updates() -> None:
    class Sum(Estimator):
        """A sum that forgets slowly: an error lasts for 1 / (1 - 0.99^2) = 50 squares."""

        inputs = (Input("u", -1.0, 1.0),)
        states = (State("s", -63.0, 63.0),)
        outputs = (Output("s"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            s = 0.99 * x.s + u.u
            return {"s": s}, {"s": s}

    got, _ = found(Sum(), exact(np.sin(T))[:, None], 18)
    (influence,) = got["s"]
    last_bit = 64.0 / 2**17
    assert influence.rms == pytest.approx(np.sqrt(50.0 / 12.0) * last_bit, rel=0.1)


def test_a_copy_for_a_state_counts_there_alone() -> None:
    got, _ = found(Late(), exact(np.sin(T))[:, None], 18)
    now, late = ([i.value for i in got[name]] for name in ("now", "late"))
    assert "s_next" in now and "s_next_aligned" not in now
    assert late[0] == "s_next_aligned"


class Replacing(Estimator):
    """Next states that operations read too, or compute again as part of a sum."""

    inputs = (Input("u", -1.0, 1.0),)
    states = (State("read", -0.99, 0.99), State("again", -0.99, 0.99))
    outputs = (Output("sin"), Output("sum"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        read = 0.6 * u.u * u.u * u.u
        again = u.u * x.read
        total = again + 0.5 * x.again
        return {"read": read, "again": again}, {"sin": ops.sincos_ht(read)[0], "sum": total}


def test_what_replaces_a_state_counts_where_it_is_read() -> None:
    got, deviation = found(Replacing(), exact(np.sin(T))[:, None], 18)
    for name, error in deviation.items():
        whole = np.sqrt(sum(i.rms**2 for i in got[name]))
        assert whole == pytest.approx(np.std(error), rel=0.1), name


@pytest.mark.parametrize(
    ("name", "limit", "count"), [("UPDATES", 300, 300), ("_MOST", 1, 2), ("UPDATES", N + 1, N)]
)
def test_the_last_updates_count(
    name: str, limit: int, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As they would alone, with the states before them."""
    inputs = np.stack([exact(np.sin(T)), exact(30.0 * np.cos(0.7 * T))], axis=1)
    build = Build(Coarse(), word=24)
    (program,), (nodes,) = build.programs, build.nodes
    words, states = words_of(program, inputs), Emitted(build).run_anew(inputs).states
    assert states is not None
    before = states[-count - 1] if count < N else None
    last = influences(program, nodes, words[-count:], states[-count:], before)
    monkeypatch.setattr(module, name, limit)
    assert influences(program, nodes, words, states) == last


def test_what_is_exact_has_no_influence() -> None:
    class Exact(Estimator):
        """A copy, and a copy by way of a state."""

        inputs = (Input("u", -1.0, 1.0),)
        states = (State("s", -1.0, 1.0),)
        outputs = (Output("now"), Output("late"))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            return {"s": u.u}, {"now": u.u, "late": x.s}

    assert found(Exact(), exact(np.sin(T))[:, None], 18)[0] == {"now": [], "late": []}


def test_two_updates() -> None:
    """The first one's state makes an error in the second, whose own makes one in none."""
    inputs = np.array([[0.37], [0.59]])
    got, _ = found(Late(), inputs, 18)
    build = Build(Late(), word=18)
    (program,), (nodes,) = build.programs, build.nodes
    words, states = words_of(program, inputs), Emitted(build).run_anew(inputs).states
    assert states is not None
    errors = rounding_errors(program, nodes, words, states)
    (copy,) = (i for i in got["late"] if i.value == "s_next_aligned")
    (number,) = (n for n, v in enumerate(program.values) if v.name == copy.value)
    assert copy.rms == pytest.approx(0.5 / np.sqrt(2.0) * errors[number].rms)


def test_what_grows_without_end_is_left_out() -> None:
    class Tripling(Estimator):
        """An angle whose errors are three times as large an update later."""

        inputs = (Input("u", -1.0, 1.0),)
        states = (State("a", -1.0, 1.0, "ht"),)
        outputs = (Output("a", "ht"), Output("square"))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            a = ops.wrap_ht(3.0 * x.a + 0.3 * u.u)
            return {"a": a}, {"a": a, "square": u.u * u.u}

    got, _ = found(Tripling(), exact(np.sin(T), 2.0**16)[:, None], 18)
    assert got["a"] == [] and [i.share for i in got["square"]] == [1.0]
