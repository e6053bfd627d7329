"""Scripts and README of an ISE project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gateware.boards.frames import word_bytes
from gateware.boards.top import Top
from gateware.registers import PROGRAM
from model.program import Program

__all__ = ["BUILD_BAT", "BUILD_SH", "readme"]

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
{name} on {title}
{rule}

Core     {name}, configuration {config}, {lanes} lane(s), {word}-bit words,
         {inputs} inputs, {outputs} outputs, {interval} cycles per update
Program  {digest}
{programs}Part     {part}
Clock    {clock}
Line     {baud} baud, 8 data bits, no parity, 1 stop bit, 3.3 V levels

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

ON THE LINE
Frames as of SLIP (RFC 1055), escaped: C0 body C0; in the body C0 becomes DB DC, DB becomes DB DD.
Body: kind (1 byte), words ({bytes} bytes each, least significant first), CRC-8 (polynomial 07,
start 00) of all before it.
  1 record  {inputs} words  answered by kind 1 with {outputs} words, in the order below
  2 write   2 words: register address, word     answered by kind 2 with the address
  3 read    1 word: register address            answered by kind 3 with the register's word
Every good frame gets one answer, in order; one more may be sent before it has come. Damaged frames
are dropped without an answer. Begin with a byte C0 after a pause.
gateware/boards/frames.py has both directions in Python. Registers: the register map of the core.

A word is an integer n; its value is n * 2^-f.
{streams}"""

_PROGRAMS = """\

The core holds these programs. It begins with number 0; write another number to register {register}
(kind 2 below) to change. Each keeps its states while others run.
{table}
"""


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    """Columns, left-aligned."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True))
                     .rstrip() for row in rows)


def _streams(program: Program) -> str:
    """Words of the records of a program."""
    rows = [("", "name", "f", "unit")]
    for label, numbers, names in (
            ("in", program.inputs, [program.values[n].name for n in program.inputs]),
            ("out", program.outputs, program.output_names)):
        rows += [(label, name, str(program.values[n].frac), program.values[n].unit)
                 for n, name in zip(numbers, names, strict=True)]
    return _table(rows) + "\n"


def _mhz(hz: int) -> str:
    return f"{hz / 1e6:g} MHz"


def readme(*, top: Top, title: str, part: str, pins: Mapping[str, str],
           connector: tuple[str, int], positions: Mapping[str, str], oscillator_hz: int) -> str:
    """README.txt of a project.

    Parameters
    ----------
    top : Top
        What is on the board.
    pins : mapping
        Pin of every net (`gateware.boards.ise.pins`).
    positions : mapping
        Position on the connector of ``rx``, ``tx``, and of the LEDs if they are there.
    """
    core = top.core
    program = core.program
    clock_hz = int(top.clock_hz)
    header = f"{connector[0]}_{connector[1]}"

    def place(name: str) -> str:
        return f"{header} position {positions[name]}" if name in positions else "on the board"

    rows = [("signal", "FPGA pin", "where", "meaning")]
    for net, pin in pins.items():
        if net.startswith("uart"):
            name = "rx" if "rx" in net else "tx"
            meaning = {"rx": "serial line to the board: TXD of the adapter",
                       "tx": "serial line from the board: RXD of the adapter"}[name]
            rows.append((name, pin, place(name), meaning))
        elif net.startswith("led"):
            name = "heartbeat" if "_0_" in net else "saturated"
            meaning = {"heartbeat": f"LED: toggles every {2 ** (top.heartbeat_bits - 1)} updates",
                       "saturated": "LED: a result of the last update was clamped"}[name]
            rows.append((name, pin, place(name), meaning))
        else:
            rows.append(("clock", pin, "on the board", f"oscillator, {_mhz(oscillator_hz)}"))
    parts = core.parts
    streams = "\n".join((f"{p.program.name}\n" if len(parts) > 1 else "") + _streams(p.program)
                        for p in parts)
    programs = "" if len(parts) == 1 else _PROGRAMS.format(register=PROGRAM, table=_table(
        [("number", "name", "cycles per update"),
         *((str(k), p.program.name, str(p.schedule.interval)) for k, p in enumerate(parts))]))
    cycles = sorted({p.schedule.interval for p in parts})
    own = clock_hz == oscillator_hz
    heading = f"{core.name} on {title}"
    return _README.format(
        name=core.name, title=title, rule="=" * len(heading), config=core.machine.name,
        lanes=core.machine.lanes, word=core.machine.arithmetic.word,
        bytes=word_bytes(core.machine.arithmetic.word), inputs=len(program.inputs),
        outputs=len(program.outputs), digest=core.digest, programs=programs,
        interval=f"{cycles[0]} to {cycles[-1]}" if cycles[1:] else str(cycles[0]),
        part=part, baud=top.baud, connector=header,
        clock=f"{_mhz(clock_hz)}, " + ("the board's oscillator" if own else
                                       f"by PLL from the board's {_mhz(oscillator_hz)}"),
        derived="" if own else f",\nfrom which ISE derives {_mhz(clock_hz)} behind the PLL",
        pins=_table(rows), streams=streams)
