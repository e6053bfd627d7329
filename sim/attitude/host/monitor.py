"""Attitudes and registers of a board, from its serial port or a captured file."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from boresight.gateware.attitude.system.attitude_frame import Attitude, Update, Values
from boresight.gateware.attitude.system.interface import INITIAL_STATES
from boresight.gateware.boards.frames import Kind
from boresight.gateware.registers.model import Access, Register
from boresight.model.errors import InputError, require
from boresight.model.tools.files import OutputFile, require_distinct
from boresight.sim.attitude.host.line import BoardLine, Listener, RegisterTable, value_of, word_of
from boresight.sim.attitude.host.plot import plot_image
from boresight.sim.attitude.host.record import log_of
from boresight.sim.records.files import check_written, content_of
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.records.record import Column
from boresight.sim.result import Result

#: Most bits per second.
_BAUD_MOST = 100_000_000
#: Longest command to the compass: with its line end as many bytes as wait on the board.
_LINE_MOST = 14
#: Writes that begin a record.
_RECORDING = ("output_divider=1", "output_mode=record", f"order={INITIAL_STATES.mask}")
_COLUMNS = (
    "number",
    "time_s",
    "heading_deg",
    "pitch_deg",
    "roll_deg",
    "qw",
    "qx",
    "qy",
    "qz",
    "flags",
    "status",
)


@dataclass(frozen=True)
class Track:
    """Attitudes in time, or outputs of other estimators.

    ``number`` goes on behind 65535. ``gaps`` holds, for each place after which frames are missing,
    the index of the attitude before and how many.
    """

    attitudes: tuple[Update, ...]
    number: tuple[int, ...]
    time_s: tuple[float, ...]
    gaps: tuple[tuple[int, int], ...]

    @property
    def missing(self) -> int:
        """Frames that did not come."""
        return sum(count for _, count in self.gaps)


@dataclass(frozen=True)
class RegisterWord:
    """A register as it was read.

    Attributes
    ----------
    word : int
        Its 32 bits.
    value : int, float, str or mapping
        What they mean by the register map; of a status the names of its fields.
    unit : str
    """

    word: int
    value: Any
    unit: str


def _lines(
    written: Mapping[str, int],
    registers: Mapping[str, RegisterWord],
    attitudes: int,
    missing: int,
    bad: int,
) -> Iterator[str]:
    """Registers as they were written and read, and what came."""
    yield from (f"{name} = 0x{word:08x} written" for name, word in written.items())
    for name, register in registers.items():
        value = register.value
        if isinstance(value, dict):
            shown = ", ".join(f"{k} {v}" for k, v in value.items())
        else:
            shown = f"{value:.9g}" if isinstance(value, float) else str(value)
        yield f"{name} = {shown} {register.unit}".rstrip() + f"  (0x{register.word:08x})"
    if attitudes or not (written or registers):
        yield f"{attitudes} attitudes, {missing} missing, {bad} frames damaged"


def track_of(attitudes: Sequence[Update], *, clock_hz: float) -> Track:
    """Put attitudes in a row. The commonest step of the numbers is the one without a gap."""
    numbers: list[int] = []
    times: list[float] = []
    for k, attitude in enumerate(attitudes):
        before = attitudes[k - 1]
        step = (attitude.number - before.number) % 2**16 if k else 0
        numbers.append(numbers[-1] + step if k else attitude.number)
        ticks = (attitude.stamp - before.stamp) % 2**32
        times.append(times[-1] + ticks / clock_hz if k else 0.0)
    steps = [b - a for a, b in zip(numbers, numbers[1:], strict=False)]
    usual = max(1, Counter(steps).most_common(1)[0][0]) if steps else 1
    gaps = tuple((k, (step - 1) // usual) for k, step in enumerate(steps) if step > usual)
    return Track(tuple(attitudes), tuple(numbers), tuple(times), gaps)


def attitude_line(attitude: Update) -> str:
    """One line for people."""
    notes = ", ".join(attitude.flag_names)
    if isinstance(attitude, Values):
        shown = "  ".join(f"{name} {value:+.6g}" for name, value in attitude.values.items())
        return f"{attitude.number:5d}  {shown}{'  ' + notes if notes else ''}"
    assert isinstance(attitude, Attitude)
    status = "--" if attitude.status is None else f"{attitude.status:02X}"
    return (
        f"{attitude.number:5d}  heading {attitude.heading:+8.2f}  pitch {attitude.pitch:+7.2f}"
        f"  roll {attitude.roll:+8.2f}  filter {attitude.filter}  status {status}"
        f"{'  ' + notes if notes else ''}"
    )


def _csv(track: Track) -> str:
    """The track as CSV; what is not known is empty."""
    names = [n for a in track.attitudes if isinstance(a, Values) for n in a.values]
    columns = dict.fromkeys([*_COLUMNS, *names])
    if not any(isinstance(a, Attitude) for a in track.attitudes):
        columns = dict.fromkeys(["number", "time_s", *names, "flags"])
    rows = [",".join(columns)]
    for k, a in enumerate(track.attitudes):
        cells = {"number": str(track.number[k]), "time_s": f"{track.time_s[k]:.8f}"}
        cells |= {"flags": f"0x{a.flags:04x}", **_cells(a)}
        rows.append(",".join(cells.get(name, "") for name in columns))
    return "\n".join(rows) + "\n"


def _cells(update: Update) -> dict[str, str]:
    """What an update tells, by column."""
    if isinstance(update, Values):
        return {name: f"{value:.9g}" for name, value in update.values.items()}
    assert isinstance(update, Attitude)
    cells = {f"{name}_deg": f"{getattr(update, name):.7f}" for name in ("heading", "pitch", "roll")}
    if update.quaternion is not None:
        parts = zip(("qw", "qx", "qy", "qz"), update.quaternion, strict=True)
        cells |= {name: f"{q:.9f}" for name, q in parts}
    return cells if update.status is None else {**cells, "status": f"0x{update.status:02x}"}


def _picture(track: Track, kind: str) -> bytes:
    """An image of the attitudes."""
    shown = [a for a in track.attitudes if isinstance(a, Attitude)]
    if len(shown) < len(track.attitudes):
        raise InputError.at(
            "--output",
            wanted="attitudes",
            found="other outputs",
            fix="leave it out, or name a .csv",
        )
    return plot_image(track.time_s, shown, track.gaps, kind)


def _assignment(text: str) -> tuple[str, str]:
    name, separator, value = text.partition("=")
    if not separator or not name or not value:
        raise InputError.at(
            "--write", wanted="NAME=VALUE", found=repr(text), fix="for example --write filter=mekf"
        )
    return name, value


def _values(text: str) -> Iterator[tuple[str, str]]:
    """Registers of an ``@FILE`` of parameters, by program."""
    path = text[1:]
    data = read_json(path, "a file of parameters")
    programs = data.get("parameters") if isinstance(data, dict) else None
    if not isinstance(programs, dict) or not all(isinstance(v, dict) for v in programs.values()):
        raise InputError.at(
            path,
            wanted="parameters of programs, as boresight fit board writes them",
            found=kind_of(data),
            fix="give such a file",
        )
    for program, some in programs.items():
        yield from ((f"{program}.{name}", repr(value)) for name, value in some.items())


def _nothing(source: str, bad: int) -> InputError:
    return InputError.at(
        source,
        wanted="frames with attitudes",
        found=f"none, and {bad:,} damaged pieces" if bad else "none",
        fix="check --baud and register output_mode, and that this came from the board",
    )


def _words(table: RegisterTable, writes: Sequence[str]) -> list[tuple[Register, int]]:
    """Registers to write, and what."""
    pairs = (_values(text) if text[:1] == "@" else [_assignment(text)] for text in writes)
    to_write = [(table.find(name), value) for name, value in chain.from_iterable(pairs)]
    words = []
    for register, value in to_write:
        is_line = register.name == "compass_command" and value[0] in "*#"
        if is_line and not (value.isascii() and len(value) <= _LINE_MOST):
            raise InputError.at(
                f"--write {register.name}",
                wanted=f"a command of up to {_LINE_MOST} ASCII characters",
                found=repr(value),
                fix="shorten it",
            )
        texts = [str(0x100 | ord(c)) for c in f"{value}\r\n"] if is_line else [value]
        words += [(register, word_of(register, text)) for text in texts]
    return words


def _readable(table: RegisterTable, reads: Sequence[str]) -> list[Register]:
    """Registers to read."""
    to_read = [table.find(name) for name in reads]
    for register in to_read:
        if register.access is Access.WRITE_ONLY:
            raise InputError.at(
                f"--read {register.name}",
                wanted="a register that can be read",
                found="write-only",
                fix="choose another",
            )
    return to_read


def _read(line: BoardLine, register: Register) -> RegisterWord:
    """A register's word, its value and its unit."""
    word = line.access(Kind.READ, [register.address])
    return RegisterWord(word & 0xFFFF_FFFF, value_of(register, word), register.unit)


def _attitudes(
    line: BoardLine,
    count: int | None,
    silence_s: float,
    each: Callable[[str], None] | None,
    *,
    keep: bool,
) -> tuple[list[Update], list[float], list[str]]:
    """What comes, up to ``count``, the end of a file or Ctrl-C; and when, by this computer [s].

    To ``keep`` what came, a line that then falls silent or is gone ends it, too; the third says so.
    """
    attitudes: list[Update] = []
    heard: list[float] = []
    lost: list[str] = []
    try:
        for item in line.items(silence_s=silence_s):
            if isinstance(item, Update):
                attitudes.append(item)
                heard.append(time.monotonic())
                if each is not None:
                    each(attitude_line(item))
            if count is not None and len(attitudes) >= count:
                break
    except KeyboardInterrupt:
        pass
    except InputError as error:
        if not (keep and attitudes):
            raise
        lost.append(f"ended after {len(attitudes)} attitudes: {error}")
    return attitudes, heard, lost


def monitor(
    source: str,
    *,
    baud: int = 921_600,
    count: int | None = None,
    csv: str | Path | None = None,
    log: str | Path | None = None,
    plot: str | Path | None = None,
    reads: Sequence[str] = (),
    writes: Sequence[str] = (),
    register_map: str | Path | None = None,
    silence_s: float = 5.0,
    each: Callable[[str], None] | None = None,
) -> Result:
    """Listen to a board; first write, then read registers.

    With ``reads`` or ``writes`` and without ``count``, ``csv``, ``log`` and ``plot`` that is all. A
    port is listened to until ``count`` attitudes have come, or for ever; Ctrl-C ends it in good
    order. For ``log`` a port is told to send every update with its counts, from the filter's
    initial states on, and attitudes alone afterwards.

    The parameters are those of `boresight.monitor`.
    """
    require(count is None or count >= 1, "--steps", "1 or more", count)
    require(1 <= baud <= _BAUD_MOST, "--baud", f"1 to {_BAUD_MOST:,}", baud)
    if plot is not None and Path(plot).suffix not in (".png", ".svg", ".pdf"):
        raise InputError.at(
            "--output",
            wanted="a name with .png, .svg or .pdf",
            found=str(plot),
            fix="give such a name",
        )
    require_distinct(csv=csv, log=log, plot=plot)
    inputs = [source] if register_map is None else [source, register_map]
    table_file, log_file, picture_file = (
        None if path is None else OutputFile(path, inputs=inputs, option=option)
        for path, option in ((csv, "--output"), (log, "--log"), (plot, "--output"))
    )
    if log is not None:
        check_written(log)
    table = RegisterTable(register_map)
    words = _words(table, writes)
    to_read = _readable(table, reads)
    outputs = [path for path in (csv, log, plot) if path is not None]
    accesses_only = bool(reads or writes) and count is None and not outputs
    listener = Listener(table.formats, table.other_outputs)
    with BoardLine(source, baud=baud, listener=listener) as line:
        for register, word in words:
            line.access(Kind.WRITE, [register.address, word])
        registers = {register.name: _read(line, register) for register in to_read}
        if log is not None and line.is_port:
            for register, word in _words(table, _RECORDING):
                line.access(Kind.WRITE, [register.address, word])
        attitudes, heard, lost = list[Update](), list[float](), list[str]()
        if not accesses_only:
            keep = bool(outputs)
            attitudes, heard, lost = _attitudes(line, count, silence_s, each, keep=keep)
        if log is not None and line.is_port and not lost:
            ((register, word),) = _words(table, ["output_mode=binary"])
            line.access(Kind.WRITE, [register.address, word])
        bad = line.listener.error_count
        if not line.is_port and not attitudes:
            raise _nothing(source, bad)
    track = track_of(attitudes, clock_hz=table.clock_hz)
    if table_file is not None:
        table_file.write(_csv(track))
    if picture_file is not None and plot is not None:
        if not attitudes:
            raise _nothing(source, bad)
        picture_file.write(_picture(track, Path(plot).suffix[1:]))
    written = {r.name: word & 0xFFFF_FFFF for r, word in words}
    notes: list[str] = []
    if log_file is not None and log is not None:
        record, notes = log_of(source, attitudes, track.number, table.described, written)
        if line.is_port:
            at = dict(zip(track.number, heard, strict=True))
            times = np.array([at[int(n)] for n in record.numbers("number")])
            record = record.derived({**record.columns, "computer": Column(times, "s")})
        log_file.write(content_of(log, record))
    data = {
        "attitudes": attitudes,
        "missing": track.missing,
        "bad": bad,
        "written": written,
        "registers": registers,
    }
    lines = _lines(written, registers, len(attitudes), track.missing, bad)
    return Result(data, summary="\n".join(lines), notes=notes, failures=lost)
