"""Where every number of a report comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.routed import Mapped, Routed

__all__ = ["source_of", "sources", "tool_of"]


def source_of(data: Mapping[str, Any], path: str) -> str | None:
    """Source of the number at ``path`` (keys with dots): that of its nearest named ancestor."""
    sources: Mapping[str, str] = data["sources"]
    parts = path.split(".")
    for k in range(len(parts), 0, -1):
        if ".".join(parts[:k]) in sources:
            return sources[".".join(parts[:k])]
    return None


def tool_of(mapped: Mapped) -> str:
    """Name and version of the synthesis tool, without how it was built."""
    name, _, build = mapped.version.partition(" (")
    return f"{name} ({build.split(',')[0].rstrip(')')})" if build else name


def sources(
    data: Mapping[str, Any], area: Mapped | Routed | None, observed: str, device: Device
) -> dict[str, str]:
    """Source of each part of the report; `source_of` looks a number up.

    ``observed`` says on how many updates of what the ranges were observed; empty: not at all.
    """
    schedule = "schedule: predicted when the core was compiled, re-proven by its checker"
    counted = "measured: boresight check"
    texts = {
        "word": "chosen when the program was compiled",
        "target": "chosen when the report was made",
        "timing": schedule,
        "timing.interval_cycles_counted": counted,
        "timing.latency_cycles.min": counted,
        "timing.latency_cycles.max": counted,
        "timing.update_us": f"{schedule}; at the target's clock",
        "timing.updates_per_s": f"{schedule}; at the target's clock",
        "resources.available": device.resources["lut"].source,
        "resources.units": device.resources["lut"].source,
        "resources.percent": "part of what the device has",
        "schedule": schedule,
        "numerics": "range: compiled (range_source)"
        + (f"; observed: measured on the C model, {observed}" if observed else ""),
        "profile": "the profile that boresight fit wrote",
        "accuracy": "measured: the fixed-point program, the float64 reference and the log, sample "
        "by sample",
        "widths": "measured: the C of each width against the float64 reference, on the same log",
        "against": "each figure as its own report has it",
        "verification": f"{counted}; each level against the integer interpreter",
        "firmware": "counted in the emitted C; memory as its structures declare it",
    }
    if area is not None:
        mapped = area.mapped if isinstance(area, Routed) else area
        texts["resources"] = f"cells of the netlist by {tool_of(mapped)}: {mapped.command}"
        source = f"{area.source}: {area.command}"
        texts |= dict.fromkeys(("timing.fmax_mhz", "timing.critical_path"), source)
        texts["timing.update_us_at_fmax"] = f"latency over fmax_mhz: {area.source}"
    if data["firmware"]["source"] is not None:
        texts["firmware.updates_per_s"] = str(data["firmware"]["source"])
    return texts
