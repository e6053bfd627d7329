"""`sim.report.numerics`: rows of the values, and when they ask for attention."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.firmware.build import WordRanges
from boresight.gateware.core import Core
from boresight.model.words.program import Kind
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import Rounding
from boresight.sim.report.numerics import numerics_section
from boresight.sim.report.observed import Observed


@pytest.fixture(scope="module")
def observed(core: Core, check: CheckResult) -> Observed:
    value = core.program.find("residual")
    lsb = core.program.format(value).lsb
    found = Observed.of(core.program, [check])
    return dataclasses.replace(found, errors={value: Rounding(1.23456 * lsb, 8.0 * lsb**2, 2)})


def test_a_row_for_every_value_but_constants(core: Core, observed: Observed) -> None:
    program = core.program
    rows = numerics_section(program, observed)
    numbers = [n for n, v in enumerate(program.values) if v.kind is not Kind.CONST]
    assert [r["signal"] for r in rows] == [program.values[n].name for n in numbers]
    for n, row in zip(numbers, rows, strict=True):
        low, high, low_at, high_at, saturations = (int(x[n]) for x in observed.ranges[0])
        assert row["format"] == str(program.format(n))
        for end, word, at in (("min", low, low_at), ("max", high, high_at)):
            seen = row[f"observed_{end}"]
            assert seen["log"] == "synthetic_60s" and seen["sample"] == at
            assert seen["value"] == pytest.approx(program.format(n).real(word), rel=1e-6)
        assert row["saturations"] == saturations
        assert row["error_lsb"] == (1.23 if row["signal"] == "residual" else None)
        assert row["line"] == observed.lines.get(n)
        if row["signal"] == "residual":
            lsb = program.format(n).lsb
            assert row["error_max"] == pytest.approx(1.23456 * lsb, rel=1e-6)
            assert row["error_rms"] == pytest.approx(2.0 * lsb, rel=1e-6)
        blank = row["overflow"] == "WRAP" or row["kind"] == "param"
        assert (row["headroom_bits"] is None) == blank
        if not blank:  # so many times it doubles and still fits
            largest, limit = max(-low, high + 1, 1), 1 << (program.arithmetic.word - 1)
            assert row["wasted_bits"] == max(0, int(observed.headroom_bits(n)) - 1)
            assert largest * 2 ** row["headroom_bits"] == pytest.approx(limit, rel=0.004)
    heading = next(r for r in rows if r["signal"] == "heading_ht")
    assert (heading["overflow"], heading["state"], heading["unit"]) == ("WRAP", "wraps", "ht")
    assert [r["output"] for r in rows if r["output"]] == [
        name for _, name in sorted(zip(program.outputs, program.output_names, strict=True))
    ]


def test_without_a_log_nothing_is_observed(core: Core) -> None:
    for row in numerics_section(core.program, None):
        assert row["state"] in ("ok", "wraps")
        assert row["range_source"]
        for key in ("observed_min", "observed_max", "headroom_bits", "error_lsb", "saturations"):
            assert row["line"] is None and row["advice"] is None
            assert row[key] is None


def test_attention(core: Core, observed: Observed) -> None:
    program = core.program

    def state(name: str, word: int, saturations: int = 0) -> str:
        n, ranges = program.find(name), [x.copy() for x in observed.ranges[0]]
        ranges[1][n], ranges[4][n] = word, saturations
        changed = dataclasses.replace(observed, ranges=[WordRanges(*ranges)])
        return next(r["state"] for r in numerics_section(program, changed) if r["signal"] == name)

    assert state("gx", 2**30 - 1) == "ok"
    assert state("gx", 2**31 - 1) == "tight"
    proven = next(
        program.values[op.dest].name
        for op in program.ops
        if program.values[op.dest].range_source == "interval" and op.overflow.value == "SAT"
    )
    assert state(proven, 2**31 - 1) == "ok"
    assert state(proven, 2**31 - 1, saturations=3) == "saturated"
    modes = {op.dest: op.overflow.value for op in program.ops}
    claimed = next(
        n
        for n, v in enumerate(program.values)
        if modes.get(n) == "SAT" and v.range_source.startswith("declared:") and v.high > 0
    )
    value = program.values[claimed]
    assert state(value.name, 2**31 - 3) == "tight"
    # The declared end itself, not clamped: that is what the range says.
    assert state("mx", int(program.format(program.find("mx")).quantise(255.9))) == "tight"
    flag = program.find("unknown")
    least = program.format(flag).real(int(observed.ranges[0].low[flag]))
    assert least == program.values[flag].low == -2.0
    assert state("unknown", 0) == "ok"
