"""What a log did to every value, against the interpreter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.report.observed import Observed


def test_extremes_are_those_of_the_interpreter(core: Core, check: CheckResult) -> None:
    found, machine = Observed.of(core.program, [check]), Interpreter(core.program)
    (words_of_log,) = found.words
    assert found.logs == ["synthetic_60s"] and len(words_of_log) == 300
    assert found.said == "300 updates of synthetic_60s"
    rows = []
    for row in words_of_log:
        machine.update(row[:, None])
        rows.append([int(w[0]) for w in machine.values_before_commit()])
    words = np.array(rows)
    (ranges,) = found.ranges
    assert np.array_equal(ranges.low, words.min(axis=0))
    assert np.array_equal(ranges.high_at, words.argmax(axis=0))
    assert found.errors and all(e.samples == 300 for e in found.errors.values())
    value = core.program.find("residual")
    form = core.program.format(value)
    assert 0.0 < found.errors[value].largest < 64.0 * form.lsb
    assert found.reached(value) == (
        form.real(words[:, value].min()),
        form.real(words[:, value].max()),
    )
    assert found.lines[core.program.find("gx")].startswith("nine_axis.py, line ")
    assert found.lines[value].startswith("complementary.py, line ")


class Sum(Estimator):
    """Saturates at 4."""

    inputs = (Input("u", -1.0, 1.0, ""),)
    states = (State("y", -4.0, 4.0, ""),)
    outputs = (Output("y", ""),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Sum."""
        return {"y": x.y + u.u}, {"y": x.y}


def test_several_logs_each_from_a_reset_on() -> None:
    build = Build(Sum())
    checking = Check(build, levels=("fixed",))
    logs = {"up": [1.0] * 6, "again": [1.0] * 6, "down": [0.5, -1.0, -0.5]}
    checks = [checking.run(Record.of({"u": np.array(u)}, name=name))[0] for name, u in logs.items()]
    (program,) = build.programs
    found = Observed.of(program, checks)
    state = program.find("y")
    after = dict(program.states)[state]
    low, high = found.extremes(program.find("u"))
    assert (low.log, low.sample, high.log, high.sample) == ("down", 1, "up", 0)
    assert found.reached(state) == (-0.5, 5.0)
    # The word ends at 8, twice the range: nothing saturates unless states go on to the next log.
    assert found.saturations(after) == 0
    assert found.reached(after) == (-1.0, 6.0)
    assert all(e.samples == 15 for e in found.errors.values()) and found.errors
    assert found.said == "6 updates of up, 6 updates of again, 3 updates of down"


@pytest.mark.parametrize(
    ("low", "high", "bits"), [(0, 0, 31), (0, 1, 30), (-1, 0, 31), (-2, 1, 30), (-5, 2**30 - 1, 1)]
)
def test_headroom(low: int, high: int, bits: float, core: Core, check: CheckResult) -> None:
    found = Observed.of(core.program, [check])
    found.ranges[0].low[3], found.ranges[0].high[3] = low, high
    assert found.headroom_bits(3) == bits
