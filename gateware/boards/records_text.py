"""What README.txt says of a core that the host feeds (`gateware.boards.top.Top`)."""

from __future__ import annotations

from boresight.gateware.boards.frames import word_bytes
from boresight.gateware.boards.ise_text import table
from boresight.gateware.core import Core
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.program import Program

__all__ = ["records_text"]

_HEAD = """\
Core     {name}, configuration {config}, {lanes} lane(s), {word}-bit words,
         {inputs} inputs, {outputs} outputs, {interval} cycles per update
Program  {digest}
Line     {baud} baud, 8 data bits, no parity, 1 stop bit, 3.3 V levels
{programs}"""

_BODY = """\
ON THE LINE
Frames as of SLIP (RFC 1055), escaped: C0 body C0; in the body C0 becomes DB DC, DB becomes DB DD.
Body: kind (1 byte), words ({bytes} bytes each, least significant first), CRC-16 of all before it
(as HDLC and PPP: polynomial 1021 reflected, start FFFF, inverted; least significant byte first).
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


def records_text(core: Core, *, baud: float) -> tuple[str, str]:
    """Head and end of the README."""
    program, parts = core.program, core.parts
    records = "\n".join(
        (f"{p.program.name}\n" if len(parts) > 1 else "") + _streams(p.program) for p in parts
    )
    programs = (
        ""
        if len(parts) == 1
        else _PROGRAMS.format(
            register=PROGRAM,
            table=table(
                [
                    ("number", "name", "cycles per update"),
                    *(
                        (str(k), p.program.name, str(p.schedule.interval))
                        for k, p in enumerate(parts)
                    ),
                ]
            ),
        )
    )
    cycles = sorted({p.schedule.interval for p in parts})
    counts = {"inputs": len(program.streamed), "outputs": len(program.outputs)}
    head = _HEAD.format(
        name=core.name,
        config=core.machine.name,
        lanes=core.machine.lanes,
        word=core.machine.arithmetic.word,
        digest=core.digest,
        programs=programs,
        baud=baud,
        interval=f"{cycles[0]} to {cycles[-1]}" if cycles[1:] else str(cycles[0]),
        **counts,
    )
    return head, _BODY.format(
        bytes=word_bytes(core.machine.arithmetic.word), streams=records, **counts
    )


def _streams(program: Program) -> str:
    """Words of the records of a program."""
    rows = [("", "name", "f", "unit")]
    for label, numbers, names in (
        ("in", program.streamed, [program.values[n].name for n in program.streamed]),
        ("out", program.outputs, program.output_names),
    ):
        rows += [
            (label, name, str(program.values[n].frac), program.values[n].unit)
            for n, name in zip(numbers, names, strict=True)
        ]
    return table(rows) + "\n"
