"""Proposals: which, what they are worth, and where they are written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.fit.fitting import Effect, Fitted, effect, fitted
from boresight.sim.fit.propose import Proposal, applied, proposals, with_ranges, worth

RECORDS = {"log": np.sin(0.1 * np.arange(600.0))[:, None]}


class Wide(Estimator):
    """States that are declared far too wide, one as it should be, and an angle."""

    inputs = (Input("u", -100.0, 100.0),)
    states = (
        State("wide", -3000.0, 3000.0, "m"),
        State("start", 0.0, 64.0, initial=30.0),
        State("snug", -1.0, 1.0),
        State("turn", -1.0, 1.0, "ht"),
    )
    outputs = (Output("wide", "m"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Low passes."""
        wide = 0.9 * x.wide + 0.1 * u.u
        snug = 0.5 * x.snug + 0.0045 * u.u
        after = {"wide": wide, "start": 0.5 * x.start, "snug": snug, "turn": x.turn * 0.5}
        return after, {"wide": wide}


@pytest.fixture(scope="module")
def found() -> Fitted:
    return fitted(Wide(), RECORDS, starts=())


def test_what_gains_bits_is_proposed_most_first(found: Fitted) -> None:
    made = {p.name: p for p in proposals(found)}
    assert [p.bits for p in made.values()] == sorted((p.bits for p in made.values()), reverse=True)
    assert made.keys() == {"wide", "u", "snug"}  # neither what started at half nor the angle
    wide = made["wide"]
    assert wide.kind == "state" and wide.declared == (-3000.0, 3000.0) and wide.unit == "m"
    assert wide.seen[1] == pytest.approx(0.77, abs=0.01)
    assert wide.proposed == (-31.97, 31.97) and wide.bits == 7
    assert made["u"].kind == "input" and made["u"].line.startswith("test_propose.py, line ")


def test_what_it_is_worth(found: Fitted) -> None:
    (wide,) = (p for p in proposals(found) if p.name == "wide")
    before = effect(Wide(), found.profile, RECORDS)
    after = worth(found, [wide], RECORDS)
    assert isinstance(before, Effect) and isinstance(after, Effect)
    assert after.saturated_updates == 0
    assert after.differences[0].largest < 0.1 * before.differences[0].largest
    assert Wide.states[0].high == 3000.0
    assert with_ranges(Wide(), [wide]).states[0].high == 31.97


def proposal(kind: str, name: str, low: float, high: float) -> Proposal:
    return Proposal(kind, name, "", "", (-9.0, 9.0), (0.0, 1.0), (low, high), 1)


def test_they_are_written_where_the_name_stands() -> None:
    text = """ä = 1; a = Input("a", -100.0, 1e2, "m")
s = (
    State("a", -4.0,
          2 * 8.0, initial=1.0), State("b", low, high),
    *(State(n, -1.0, 1.0) for n in "cd"),
)
"""
    those = [
        proposal("state", "a", -0.5, 0.999),
        proposal("input", "a", 0.0, 7.992),
        proposal("state", "b", -1.0, 1.5),
        proposal("state", "c", -0.1, 0.1),
    ]
    wanted = (
        text.replace("-100.0, 1e2", "0.0, 7.992")
        .replace("-4.0,", "-0.5,")
        .replace("2 * 8.0", "0.999")
        .replace("low, high", "-1.0, 1.5")
    )
    assert applied(text, those) == (wanted, [those[3]])
