"""Scripts and README of an ISE project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.gateware.boards.board import Board

__all__ = ["BUILD_BAT", "BUILD_SH", "readme", "table"]

_TOOLS = "xst ngdbuild map par bitgen trce"

BUILD_SH = f"""\
#!/usr/bin/env bash
# Synthesis, placement, routing, bitstream and timing report: all of it. See README.txt.
cd "$(dirname "$0")" || exit 2
if [ -n "$AMARANTH_ENV_ISE" ]; then . "$AMARANTH_ENV_ISE"; fi
for tool in {_TOOLS}; do
  if ! command -v "$tool" >/dev/null 2>&1; then
    echo "error: $tool is not on the PATH: install ISE 14.7 (WebPACK will do), run" >&2
    echo "  . <where it is>/14.7/ISE_DS/settings64.sh" >&2
    echo "in this shell, then run build.sh again" >&2
    exit 2
  fi
done
set -e
bash ./build_top.sh
trce -v 3 -s 2 -n 3 top_par.ncd top.pcf -o top.twr
echo
echo "top.bit is the bitstream, top.twr the timing report:"
grep -E "Minimum period|timing errors? detected|All constraints were met" top.twr || true
"""

BUILD_BAT = f"""\
@rem Synthesis, placement, routing, bitstream and timing report: all of it. See README.txt.
@echo off
setlocal
cd /d "%~dp0"
if defined AMARANTH_ENV_ISE call "%AMARANTH_ENV_ISE%"
for %%t in ({_TOOLS}) do (
  where %%t >nul 2>nul
  if errorlevel 1 (
    echo error: %%t is not on the PATH: install ISE 14.7 and run build.bat in its command prompt
    exit /b 2
  )
)
call build_top.bat || exit /b
trce -v 3 -s 2 -n 3 top_par.ncd top.pcf -o top.twr || exit /b
echo top.bit is the bitstream, top.twr the timing report:
findstr /c:"Minimum period" /c:"timing errors" /c:"All constraints were met" top.twr
exit /b 0
"""

_README = """\
{title}
{rule}

{head}Part     {part}
Clock    {clock}

BUILD
  ./build.sh      (Linux; Windows: build.bat in the command prompt of ISE)
once, with ISE 14.7 on the PATH. It runs xst, ngdbuild, map, par, bitgen and trce, and leaves
  top.bit, top.bin  bitstream
  top.twr           timing report of trce: the clock that counts, after routing
  top_map.mrp       what the core takes of the part
  top.par           routing
top.ucf asks for the period of the board's oscillator{derived}; "timing errors" in
top.twr says whether it was met. These files were made without ISE.

PINS
{pins}
Positions are those of connector {connector} in amaranth-boards, counted from 1. The FPGA's pins are
what counts: check them against the schematic of your board before you connect anything, and use a
serial adapter with 3.3 V levels.

{body}"""


def table(rows: Sequence[tuple[str, ...]]) -> str:
    """Columns, left-aligned."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _mhz(hz: int) -> str:
    return f"{hz / 1e6:g} MHz"


def readme(
    *, design: Any, board: Board, part: str, pins: Mapping[str, str], oscillator_hz: int
) -> str:
    """README.txt of a project.

    Parameters
    ----------
    design : gateware.boards.ise.Design
        What is on the board.
    pins : mapping
        Pin of every net (`gateware.boards.ise.pins`).
    """
    clock_hz = int(design.clock_hz)
    by_net = {
        f"{'led_' + line.place[3:] if line.place.startswith('led') else line.name + '_0'}__io": line
        for line in design.lines
    }
    rows = [("signal", "FPGA pin", "where", "meaning")]
    for net, pin in pins.items():
        line = by_net.get(net)
        rows.append(
            ("clock", pin, "on the board", f"oscillator, {_mhz(oscillator_hz)}")
            if line is None
            else (line.name, pin, board.where(line), line.meaning)
        )
    own = clock_hz == oscillator_hz
    title = f"{design.title} on {board.title}"
    head, body = design.text()
    return _README.format(
        title=title,
        rule="=" * len(title),
        head=head,
        body=body,
        part=part,
        connector=board.header,
        pins=table(rows),
        clock=f"{_mhz(clock_hz)}, "
        + ("the board's oscillator" if own else f"by PLL from the board's {_mhz(oscillator_hz)}"),
        derived="" if own else f",\nfrom which ISE derives {_mhz(clock_hz)} behind the PLL",
    )
