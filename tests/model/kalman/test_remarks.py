"""What a run shows of a model: states that nothing shows, measurements that never count."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import boresight
from boresight import Input
from boresight.kalman import Kalman, Measurement, State, Textbook
from boresight.model.estimator import SecondForm

STATES = ("pos", "shift", "bias")


class Doubtful(Kalman):
    """A position in two shares, a bias, and measurements that are chosen."""

    inputs = (Input("z", -100.0, 100.0, "m"), Input("there", 0.0, 1.0))
    states = (
        State("pos", -128.0, 128.0, "m", sd=2.0, sd_max=4.0),
        State("shift", -128.0, 128.0, "m", sd=2.0, sd_max=4.0),
        State("bias", -1.0, 1.0, "m/s", sd=0.5, sd_max=1.0),
    )
    seen, moved, gate, valid = STATES, True, None, False
    sure = 1.0  #: largest standard deviation of the bias

    def __init__(self) -> None:
        self.states = (*self.states[:-1], replace(self.states[-1], sd_max=self.sure))
        super().__init__()

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"pos": x.pos + 0.1 * x.bias} if self.moved else {}

    def noise(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"pos": 1e-3, "shift": 1e-3, "bias": 1e-6}

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        h = sum((getattr(x, name) for name in self.seen[1:]), getattr(x, self.seen[0]))
        valid = u.there > 0.5 if self.valid else None
        return [Measurement(u.z, h, 0.25, gate=self.gate, valid=valid)]


def told(run: SecondForm, *later: list[float]) -> list[str]:
    assert run.absent
    return [*run.remarks, *run.absent(np.reshape(later, (-1, 2)))]


def remarks(z: float = 1.0, there: float = 1.0, **options: Any) -> list[str]:
    kalman = type("Doubtful", (Doubtful,), options)()
    run = Textbook(kalman).run(np.tile([z, there], (40, 1)))
    return [*told(run), *(text for _, text in run.faults)]


@pytest.mark.parametrize(
    ("options", "texts"),
    [
        ({"seen": ("pos",)}, ["no measurement of 40 updates shows shift;"]),
        ({"seen": ("shift",)}, ["shows pos;", "shows bias;"]),
        ({"seen": ("pos",), "moved": False}, ["shows shift;", "shows bias;"]),
        (
            {"seen": ("pos", "shift")},
            ["shows a change of pos by 1 m and of shift by -1 m; measure one"],
        ),
        ({"seen": ("pos",), "valid": True, "there": 0.0}, ["not valid in any of 40 updates"]),
        (
            {"seen": ("pos",), "sure": 0.55},
            ["shows shift;", r"variance of bias is held at its largest in \d+ of 40 updates;"],
        ),
        (
            {"seen": ("pos",), "noise": lambda self, x, u, p: {"pos": 1e-3}, "floor": 0.0},
            ["shows shift;", "shift has no process noise", "bias has no process noise"],
        ),
    ],
)
def test_each_has_one_line_with_its_place(options: dict[str, Any], texts: list[str]) -> None:
    found = remarks(**options)
    for text in texts:
        (line,) = [x for x in found if re.search(text, x)]
        assert line.startswith("test_remarks.py, line ")
    if "valid" not in options:
        assert len(found) == len(texts)


def test_a_bias_is_seen_through_what_it_moves() -> None:
    class Seen(Doubtful):
        states = (Doubtful.states[0], Doubtful.states[2])
        seen = ("pos",)

        def noise(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"pos": 1e-3, "bias": 1e-6}

    inputs = np.tile([1.0, 1.0], (40, 1))
    assert told(Textbook(Seen()).run(inputs)) == []
    assert "shows bias" in told(Textbook(Seen()).run(inputs[:1]))[0]  # nothing has moved yet


@pytest.mark.parametrize(
    ("there", "texts"),
    [
        (1.0, []),
        (
            0.0,
            ["not valid in any of 42 updates", *(f"first 40 updates shows {s};" for s in STATES)],
        ),
    ],
)
def test_what_later_rows_may_show_is_not_missed(there: float, texts: list[str]) -> None:
    kalman = type("Doubtful", (Doubtful,), {"valid": True})()
    found = told(Textbook(kalman).run(np.tile([1.0, 0.0], (40, 1))), [1.0, 0.0], [1.0, there])
    assert len(found) == len(texts)
    assert all(text in line for text, line in zip(texts, found, strict=True))


@pytest.mark.parametrize("gate", [None, 3.0])
def test_a_limited_innovation_is_told(gate: float | None) -> None:
    kalman = type("Doubtful", (Doubtful,), {"gate": gate})()
    inputs = np.tile([0.0, 1.0], (40, 1))
    inputs[30, 0] = 90.0
    texts = told(Textbook(kalman).run(inputs))
    limited = [x for x in texts if "the innovation is beyond 64 standard deviations in 1 of" in x]
    assert len(limited) == (gate is None)


@pytest.mark.parametrize("rate", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("later", [False, True])
@pytest.mark.parametrize(
    ("seen", "unseen"),
    [
        (("pos",), ["shift"]),
        (("shift",), ["pos", "bias"]),
        # Nothing shows a bias for which pos stays at 0.1 / (1 - rate) bias, and shift opposite.
        (("pos", "shift"), ["bias"]),
    ],
)
def test_a_state_that_grows_or_decays_hides_no_other(
    rate: float, later: bool, seen: Any, unseen: list[str]
) -> None:
    def f(self: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"pos": rate * x.pos + 0.1 * x.bias}

    kalman = type("Plant", (Doubtful,), {"f": f, "seen": seen, "valid": True})()
    updates = 400 if rate > 1.0 else 120  # what grows is to be large: 2^400
    first = updates // 2 if later else 0
    inputs = [[1.0, float(k >= first)] for k in range(updates)]
    found = [x.partition(" shows ")[2] for x in told(Textbook(kalman).run(np.array(inputs)))]
    assert [text.partition(";")[0] for text in found if text] == unseen


def test_a_run_without_numbers_ends() -> None:
    class Scaled(Doubtful):
        def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
            return [Measurement(u.z, u.there * x.pos, 0.25)]

    run = Textbook(Scaled()).run(np.tile([1.0, np.nan], (5, 1)))
    assert np.isnan(run.outputs["pos"]).all()


def test_check_warns() -> None:
    columns = {"z": np.ones(40), "there": np.ones(40)}
    (result,) = boresight.check(
        type("Doubtful", (Doubtful,), {"seen": ("pos",)}), columns, levels=("fixed",)
    )["results"]
    assert result.good and "warning: test_remarks.py" in str(result) and "shift" in str(result)


@pytest.mark.parametrize(("valid", "taken"), [(False, ["taken in 30 of 40 updates"]), (True, [])])
def test_measurements_without_a_new_sample(valid: bool, taken: list[str]) -> None:
    """Only where nothing of a measurement looks at the flag of what it reads."""
    flagged = (Input("z", -100.0, 100.0, "m", missing=0.0), Input("there", 0.0, 1.0, valid_of="z"))
    options = {"inputs": flagged, "seen": ("pos",), "valid": valid}
    kalman = type("Doubtful", (Doubtful,), options)()
    inputs = np.array([[1.0, float(k % 4 == 0)] for k in range(40)])
    faults = Textbook(kalman).run(inputs).faults
    assert [kind for kind, _ in faults] == ["hold"] * len(taken)
    assert [
        text.partition(", measurement: ")[2].partition(" without")[0] for _, text in faults
    ] == taken
    assert all(
        text.endswith("sample of z; leave these out by valid=u.there > 0.5") for _, text in faults
    )
