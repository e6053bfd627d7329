"""``python -m boresight.sim.attitude.soc``: measure estimators in C on the simulated soft core."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from typing import Any

from boresight.firmware.attitude.image import ImageError
from boresight.model.attitude import FILTERS
from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.files import output_folder
from boresight.sim.attitude.soc.board import soc_board
from boresight.sim.attitude.soc.comparison import compare
from boresight.sim.attitude.soc.offload import offload
from boresight.sim.attitude.soc.page import render_page
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record
from boresight.sim.rtl.simulators import SimulationFailed

__all__ = ["main", "table"]

_HEAD = (
    f"{'estimator':16}{'float C':>10}{'paper':>10}{'integer C':>11}{'hardware':>10}"
    f"{'int/hw':>8}{'float/hw':>10}{'code, float':>13}{'integer':>9}{'equal':>7}"
)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Cycles (medians; hardware: to the attitude), bytes of code, equality."""
    lines = [_HEAD]
    for row in rows:
        single, integer = row["float"], row["integer"]
        equal = (
            not integer["mismatches"]
            and not single["status_mismatches"]
            and single["apart_deg"] <= single["bound_deg"]
        )
        lines.append(
            f"{row['estimator']:16}{single['cycles']['median']:>10}{row['paper_cycles'] or '-':>10}"
            f"{integer['cycles']['median']:>11}{row['hardware']['cycles']:>10}"
            f"{row['ratios']['integer_to_hardware']:>8.0f}{row['ratios']['float_to_hardware']:>10.0f}"
            f"{single['code_bytes']:>13}{integer['code_bytes']:>9}{'yes' if equal else 'NO':>7}"
        )
    return "\n".join(lines)


def _measure(args: argparse.Namespace, log: Record, updates: int) -> dict[str, Any]:
    """Measure the estimators, print the table, and return the report."""
    rows = compare(
        log,
        names=args.estimator or FILTERS,
        updates=updates,
        progress=lambda text: print(text, file=sys.stderr),
    )
    print(table(rows))
    report: dict[str, Any] = {"software": rows}
    if args.board:
        print("the complete board with a soft core, mekf in hardware", file=sys.stderr)
        report["offload"] = row = offload(soc_board(filters=("mekf",)), log, updates=updates)
        print(
            f"offload: {row['in_memory']} of {row['updates']} updates in memory, "
            f"{row['mismatches']} differ; sample to update "
            f"{row['sample_to_update_cycles']['max']} cycles, to memory "
            f"{row['update_to_memory_cycles']['median']} more "
            f"(at most {row['update_to_memory_cycles']['max']})"
        )
    return report


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; exit code 1: results differ, 2: bad usage or missing compiler."""
    parser = argparse.ArgumentParser(
        prog="python -m boresight.sim.attitude.soc", description=__doc__
    )
    parser.add_argument("--updates", type=int, default=1000, help="recorded updates (%(default)s)")
    parser.add_argument("--log", default=None, help="log file (the bundled ximu_walk)")
    parser.add_argument(
        "--estimator", action="append", choices=FILTERS, help="only this one; may be repeated"
    )
    parser.add_argument(
        "--board", action="store_true", help="also the hardware's attitude on the complete board"
    )
    parser.add_argument(
        "-o", "--output", default=None, help="folder for report.json, firmware.html"
    )
    args = parser.parse_args(argv)
    try:
        if args.updates < 2:
            raise InputError.at(
                "--updates", wanted="2 or more", found=str(args.updates), fix="ask for more"
            )
        path = bundled("ximu_walk") if args.log is None else args.log
        log = read_record(path)
        updates = min(args.updates, len(log))
        if args.output is None:
            report = _measure(args, log, updates)
        else:
            files = ("firmware.html", "report.json")
            with output_folder(args.output, "firmware", files=files, inputs=[path]) as folder:
                report = _measure(args, log, updates)
                (folder / "report.json").write_text(json.dumps(report, indent=1) + "\n")
                (folder / "firmware.html").write_text(render_page(report), encoding="utf-8")
    except (InputError, ToolMissing, ImageError, SimulationFailed, OSError) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    all_equal = all(line.endswith("yes") for line in table(report["software"]).splitlines()[1:])
    return 0 if all_equal and not report.get("offload", {}).get("mismatches") else 1


if __name__ == "__main__":
    sys.exit(main())
