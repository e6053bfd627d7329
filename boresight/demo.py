"""The main job of `make`: everything, for both configurations, on the bundled recording."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.compiling import compile, core_for, estimate_core
from boresight.output import output_folder
from boresight.reporting import write_report
from model.estimators import estimator as find_estimator
from sim.bundled import bundled
from sim.check import check as check_log
from sim.log import read_log

__all__ = ["PAPER_CYCLES", "RECORDING", "demo", "summary_table"]

RECORDING = "ximu_walk"
#: Ma Long et al. 2014: 316 us for the complementary filter at 100 MHz.
PAPER_CYCLES = 31_600


def demo(name: str = "complementary", *, output: str | Path = "build", steps: int | None = None,
         progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Compile, prove on the bundled recording, estimate, report: small and fast.

    Writes ``<output>/<name>-<config>/`` (Verilog, ISE projects' input, C, register map, report) and
    ``<output>/summary.json``.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    log = read_log(Path(bundled(RECORDING)))
    rows = []
    good = True
    for config in ("small", "fast"):
        target = Path(output) / f"{name}-{config}"
        compile(name, config=config, board="mimas", output=target, progress=say)
        core = core_for(name, config=config)
        result = check_log(estimator, log, config=config, steps=steps, core=core, progress=say)
        for level in result.levels:
            say(f"  {level.line()}")
        good = good and result.good
        say("synthesis (yosys) and clock estimate")
        area = estimate_core(core)
        with output_folder(target) as folder:
            write_report(folder, name, core, result, log, area, comparison=True)
        latencies = dict(zip(core.program.output_names, core.schedule.latencies, strict=True))
        euler = max(latencies[k] for k in ("pitch", "roll", "heading"))
        fmax = area.corner(grade=2, nets="median").fmax_mhz
        rows.append({
            "config": config,
            "cycles_euler": euler,
            "cycles_attitude": max(core.schedule.latencies[:estimator.urgent]),
            "cycles_interval": core.schedule.interval,
            "paper_cycles": PAPER_CYCLES,
            "speedup": round(PAPER_CYCLES / max(core.schedule.latencies[:estimator.urgent]), 1),
            "lut": area.area.lut, "ff": area.area.ff, "dsp": area.area.dsp,
            "ramb16": area.area.ramb16,
            "clock_mhz_estimate": None if fmax is None else round(fmax, 1),
            "updates_proven": {x.simulator: x.n_total for x in result.levels},
            "mismatches": sum(x.n_mismatch for x in result.levels),
            "vs_float_max_deg": result.vs_float_max_deg,
            "report": str(target / "report.html"),
        })
    data = {"estimator": name, "log": RECORDING, "good": good, "configurations": rows}
    with output_folder(Path(output)) as folder:
        (folder / "summary.json").write_text(json.dumps(data, indent=1) + "\n")
    return data


def summary_table(data: dict[str, Any]) -> str:
    """The summary as a table for people."""
    rows = data["configurations"]
    lines = [
        ("", *(r["config"] for r in rows)),
        ("sample to Euler angles, cycles", *(r["cycles_euler"] for r in rows)),
        ("sample to quaternion, cycles", *(r["cycles_attitude"] for r in rows)),
        ("the paper's software, cycles", *(r["paper_cycles"] for r in rows)),
        ("faster by", *(f"{r['speedup']}x" for r in rows)),
        ("next sample after, cycles", *(r["cycles_interval"] for r in rows)),
        ("LUT (yosys, of 5,720)", *(r["lut"] for r in rows)),
        ("FF (of 11,440)", *(r["ff"] for r in rows)),
        ("DSP48A1 (of 16)", *(r["dsp"] for r in rows)),
        ("RAMB16 (of 32)", *(f"{r['ramb16']:g}" for r in rows)),
        ("clock, MHz (estimate, -2, median nets)", *(r["clock_mhz_estimate"] for r in rows)),
        ("updates proven in RTL", *(r["updates_proven"].get("verilator", 0) for r in rows)),
        ("mismatches, all levels", *(r["mismatches"] for r in rows)),
        ("fixed against float64, max deg", *(f"{r['vs_float_max_deg']:.6f}" for r in rows)),
    ]
    return "\n".join(f"{a:40s}" + "".join(f"{b!s:>12s}" for b in rest) for a, *rest in lines)
