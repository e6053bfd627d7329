"""Format, range and headroom of every value, as plain data."""

from __future__ import annotations

from typing import Any

from boresight.model.words.program import Kind, Overflow, Program, Value
from boresight.sim.report.extremes import Extreme, Extremes, Observed

__all__ = ["numerics_section"]


def _digits(x: float) -> float:
    return float(f"{x:.7g}")


def _extreme(extreme: Extreme) -> dict[str, Any]:
    return {"value": _digits(extreme.value), "log": extreme.log, "sample": extreme.sample}


def _state(
    value: Value, overflow: Overflow | None, seen: Observed | None, headroom: float | None
) -> str:
    """One word for how the value stands: what the report colours."""
    if seen is not None and seen.saturations:
        return "saturated"
    if overflow is Overflow.WRAP:
        return "wraps"
    if seen is None or headroom is None or headroom >= 1.0:
        return "ok"
    if overflow is Overflow.CLIP:
        return "clips"  # on purpose
    if value.kind is Kind.INPUT:
        return "tight"
    # A range that arithmetic proves may be used to its end, and so may one whose end is reached
    # exactly, unclamped (a flag, the cosine of 0); any other declared range is a claim.
    reached = (seen.low.value, seen.high.value)
    end = value.low if -reached[0] > reached[1] else value.high
    claimed = value.range_source.startswith("declared") and end not in reached
    return "tight" if claimed else "ok"


def numerics_section(program: Program, extremes: Extremes | None) -> list[dict[str, Any]]:
    """A row for every value except constants, in the order of the program.

    ``output`` names the output that the value is, or null. ``headroom_bits`` says how often the
    largest word observed could double within the format; null for parameters and for values that
    wrap, and without observation. ``overflow`` of a state is that of the value that replaces it.
    ``state`` is "saturated", "tight" (less than one bit left in a range that nothing proves),
    "wraps", "clips" (both by design) or "ok".
    """
    overflow = {op.dest: op.overflow for op in program.ops}
    following = dict(program.states)
    outputs: dict[int, list[str]] = {}
    for name, number in zip(program.output_names, program.outputs, strict=True):
        outputs.setdefault(number, []).append(name)
    rows = []
    for n, value in enumerate(program.values):
        if value.kind is Kind.CONST:
            continue
        seen = extremes.values[n] if extremes is not None else None
        mode = overflow.get(following.get(n, n))
        headroom = None
        if seen is not None and value.kind is not Kind.PARAM and mode is not Overflow.WRAP:
            headroom = round(seen.headroom_bits(program.arithmetic.word), 2)
        rows.append(
            {
                "signal": value.name,
                "kind": value.kind.value,
                "output": ", ".join(outputs[n]) if n in outputs else None,
                "unit": value.unit,
                "format": str(program.format(n)),
                "overflow": mode.value if mode is not None else None,
                "min": _digits(value.low),
                "max": _digits(value.high),
                "range_source": value.range_source,
                "format_min": _digits(program.format(n).min),
                "format_max": _digits(program.format(n).max),
                "observed_min": _extreme(seen.low) if seen is not None else None,
                "observed_max": _extreme(seen.high) if seen is not None else None,
                "headroom_bits": headroom,
                "saturations": seen.saturations if seen is not None else None,
                "state": _state(value, mode, seen, headroom),
            }
        )
    return rows
