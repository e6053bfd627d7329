"""The first value that differs, by name, step and cycle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.divergence import Divergence, first_divergence, program_at
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Seen
from tests.support.faulty import All, words_and_states

INPUTS = np.random.default_rng(8).uniform(-4.0, 4.0, 12).tolist()


@pytest.mark.parametrize("step", [0, 1, 7])
def test_a_program_with_the_states_of_a_step(step: int) -> None:
    (program,) = Build(All()).programs
    words, states = words_and_states(Build(All()), INPUTS)
    before = states[step - 1] if step else None
    whole, at = Interpreter(program), Interpreter(program_at(program, before))
    for row in words[: step + 1]:
        wanted = whole.update(row[:, None])[0]
    assert np.array_equal(at.update(words[step][:, None])[0], wanted)
    with pytest.raises(ValueError, match="shorter"):
        program_at(program, states[0][:-1])


class Wrong(Emitted):
    """One value is another, or unknown."""

    changes: dict[int, Any] = {}

    def words_of_update(self, records: Any, before: Any = (), states: Any = None) -> Sequence[Seen]:
        """With cycles."""
        seen = super().words_of_update(records, before, states)
        return [
            Seen(s.value, self.changes.get(s.value, s.word), 10 + k) for k, s in enumerate(seen)
        ]


def test_the_first_that_differs(monkeypatch: pytest.MonkeyPatch) -> None:
    build = Build(All())
    level, (program,) = Wrong(build), build.programs
    words, states = words_and_states(build, INPUTS)
    pieces, before = np.split(np.array(INPUTS)[:, None], [3, 4, 8]), states[4]
    assert first_divergence(level, pieces, before, 5) is None
    third, last = program.ops[2].dest, program.ops[-1].dest
    machine = Interpreter(program_at(program, before))
    machine.update(words[5][:, None])
    wanted = int(machine.values[third][0])
    monkeypatch.setattr(Wrong, "changes", {last: 1, third: 7})
    result = first_divergence(level, pieces, before, 5)
    name = program.values[third].name
    assert result == Divergence("c", 5, name, 12, wanted, 7)
    monkeypatch.setattr(Wrong, "changes", {third: None})
    assert first_divergence(level, pieces, before, 5) == Divergence("c", 5, name, 12, wanted, None)
