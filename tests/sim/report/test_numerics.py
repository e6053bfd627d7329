"""`sim.report.numerics`: rows of the values, and when they ask for attention."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.gateware.core import Core
from boresight.model.words.program import Kind
from boresight.sim.report.extremes import Extreme, Extremes
from boresight.sim.report.numerics import numerics_section


def test_a_row_for_every_value_but_constants(core: Core, extremes: Extremes) -> None:
    program = core.program
    rows = numerics_section(program, extremes)
    numbers = [n for n, v in enumerate(program.values) if v.kind is not Kind.CONST]
    assert [r["signal"] for r in rows] == [program.values[n].name for n in numbers]
    for n, row in zip(numbers, rows, strict=True):
        seen = extremes.values[n]
        assert row["format"] == str(program.format(n))
        assert row["observed_min"]["log"] == "synthetic_60s"
        assert row["observed_min"]["value"] == pytest.approx(seen.low.value, rel=1e-6)
        assert row["observed_max"]["sample"] == seen.high.sample
        assert row["saturations"] == seen.saturations
        blank = row["overflow"] == "WRAP" or row["kind"] == "param"
        assert (row["headroom_bits"] is None) == blank
    heading = next(r for r in rows if r["signal"] == "heading_ht")
    assert (heading["overflow"], heading["state"], heading["unit"]) == ("WRAP", "wraps", "ht")
    assert [r["output"] for r in rows if r["output"]] == [
        name for _, name in sorted(zip(program.outputs, program.output_names, strict=True))
    ]


def test_without_a_log_nothing_is_observed(core: Core) -> None:
    for row in numerics_section(core.program, None):
        assert row["state"] in ("ok", "wraps")
        assert row["range_source"]
        for key in ("observed_min", "observed_max", "headroom_bits", "saturations"):
            assert row[key] is None


def test_attention(core: Core, extremes: Extremes) -> None:
    program = core.program

    def state(name: str, word: int, saturations: int = 0) -> str:
        values = list(extremes.values)
        n = program.find(name)
        extreme = Extreme(word, float(program.format(n).real(word)), "a", 0)
        values[n] = dataclasses.replace(values[n], high=extreme, saturations=saturations)
        changed = dataclasses.replace(extremes, values=tuple(values))
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
    flag = program.find("roll_unknown")
    assert extremes.values[flag].low.value == program.values[flag].low == -1.0
    assert state("roll_unknown", 0) == "ok"
