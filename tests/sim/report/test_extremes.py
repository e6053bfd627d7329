"""`sim.report.extremes` against the interpreter, word by word."""

from __future__ import annotations

import time

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from boresight.sim.report.extremes import Extreme, Observed, observe
from tests.support.random_program import random_inputs, random_program


def every_word(program, rows, params=None):
    """All words of all updates from reset, and how often each value saturated."""
    machine = Interpreter(program)
    for name, value in (params or {}).items():
        number = program.find(name)
        machine.params[number] = int(program.format(number).quantise(value))
    words = []
    for row in rows:
        machine.update(row[:, None])
        words.append([int(w[0]) for w in machine.values_before_commit()])
    return np.array(words), machine.saturations


@pytest.mark.parametrize(("seed", "word"), [(3, 32), (4, 20), (5, 27)])
def test_equal_to_brute_force(seed: int, word: int) -> None:
    program = random_program(seed, word=word, n_ops=50, n_states=4)
    runs = {f"log {k}": np.array(random_inputs(program, 10 * seed + k, 40 + k)) for k in range(3)}
    found = observe(program, runs)
    brute = {name: every_word(program, rows) for name, rows in runs.items()}
    assert found.updates == {"log 0": 40, "log 1": 41, "log 2": 42} and found.total == 123
    for n, value in enumerate(found.values):
        for extreme, best, at in ((value.low, min, np.argmin), (value.high, max, np.argmax)):
            per_log = {name: best(words[:, n].tolist()) for name, (words, _) in brute.items()}
            assert extreme.word == best(per_log.values())
            first = next(name for name, w in per_log.items() if w == extreme.word)
            assert (extreme.log, extreme.sample) == (first, at(brute[first][0][:, n]))
            assert extreme.value == program.format(n).real(extreme.word)
        assert value.saturations == sum(int(s[n]) for _, s in brute.values())
    assert found.saturations == sum(v.saturations for v in found.values)


def test_parameters_are_set() -> None:
    program = next(
        p for p in (random_program(k, n_ops=30) for k in range(50)) if p.of_kind(Kind.PARAM)
    )
    name = program.values[program.of_kind(Kind.PARAM)[0]].name
    rows = np.array(random_inputs(program, 1, 30))
    found = observe(program, {"a": rows}, params={name: 0.4375})
    words, _ = every_word(program, rows, {name: 0.4375})
    assert [v.low.word for v in found.values] == words.min(axis=0).tolist()
    assert found.values[program.find(name)].high.value == 0.4375


@pytest.mark.parametrize(
    ("low", "high", "bits"),
    [(0, 0, 31), (-1, 0, 31), (0, 1, 30), (-(2**31), 0, 0), (0, 2**31 - 1, 0), (-(2**20), 7, 11)],
)
def test_headroom(low: int, high: int, bits: float) -> None:
    value = Observed(Extreme(low, 0.0, "a", 0), Extreme(high, 0.0, "a", 0), 0)
    assert value.headroom_bits(32) == bits


def test_fifty_thousand_updates_take_a_moment() -> None:
    program = random_program(6, n_ops=160, n_states=12)
    rows = np.array(random_inputs(program, 1, 500))
    observe(program, {"once": rows})  # compiles
    rows = np.tile(rows, (100, 1))
    start = time.process_time()
    observe(program, {"long": rows})
    assert time.process_time() - start < 0.5


def test_nothing_to_observe() -> None:
    program = random_program(1, n_ops=4)
    with pytest.raises(InputError, match=r"^logs: wanted one or more, found none; name a log$"):
        observe(program, {})
    with pytest.raises(InputError, match=r"^log 'a': wanted one sample or more, found none; .*$"):
        observe(program, {"a": np.empty((0, len(program.inputs)), dtype=np.int64)})
