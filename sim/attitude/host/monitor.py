"""Attitudes and registers of a board, from its serial port or a captured file, and its log.

`log_of` makes from frames of kind SENSED the words that the filter had, by the integer models
of the programs before it. A level that computes bit by bit then has the board's outputs, which are
the columns ``NAME_true``.
"""

from __future__ import annotations

import io
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from boresight.gateware.attitude.system.interface import FIELDS, INITIAL_STATES, Update
from boresight.gateware.attitude.system.programs import FRONT_NAMES
from boresight.gateware.boards.frames import Decoder, Kind
from boresight.gateware.description import Description
from boresight.gateware.registers import Access, Register
from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.attitude.front import FRONT
from boresight.model.errors import InputError, require
from boresight.model.estimator import with_params
from boresight.model.tools.files import OutputFile
from boresight.model.tools.reading import kind_of, read_json
from boresight.model.words.program import Program
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples, calibrated
from boresight.sim.attitude.host.line import BoardLine, Listener, RegisterTable, value_of, word_of
from boresight.sim.plotting import COLOUR, INK, figure_and_axes, settings
from boresight.sim.records.files import check_written, content_of
from boresight.sim.records.record import TRUTH, Column, Record
from boresight.sim.result import Result

_RAW = tuple(f"{s}{a}_counts" for s in "ga" for a in "xyz")
_FIELD = tuple(f"m{a}_counts" for a in "xyz")
_ANGLES = ("compass_heading_deg", "compass_pitch_deg", "compass_roll_deg")


def _flag(updates: Sequence[Update], name: str) -> BoolArray:
    return np.array([FIELDS[name].of(u.flags << 16) for u in updates], dtype=np.bool_)


def log_of(
    source: str,
    updates: Sequence[Update],
    numbers: Sequence[int],
    described: Description | None,
    written: Mapping[str, int],
) -> tuple[Record, list[str]]:
    """Return the log of one filter's updates from its initial states on, and notes.

    ``t`` [s] from the first row on; the inputs of the filter; its outputs as ``NAME_true``;
    ``number``, ``stamp`` [cycles] and ``flags`` of the frame; the counts of the ADIS16385 (of
    +-300 deg/s), and of the compass's line its counts or its angles, empty without a new one.
    Numbers are exact. ``restart`` is 1 where the filter began anew from its initial states.

    ``source`` is the port or file, for messages; ``numbers`` are those of `track_of`; ``written``
    are words of parameters that the host has written, by register.

    `InputError`: no frame of kind SENSED, none that begins from initial states, no register map, or
    a filter with inputs from registers.
    """
    if described is None or not described.parameters_of(FRONT_NAMES[0]):
        raise InputError.at(
            "--log",
            wanted="the register map of the complete system",
            found="none" if described is None else f"that of a {described.title}",
            fix="add --map registers.json",
        )
    has_counts = np.array([u.sensed is not None for u in updates], dtype=np.bool_)
    begins = _flag(updates, "initial_states") & has_counts
    found = f"{int(has_counts.sum())} of {len(updates)} updates with counts, "
    found += "none of them from initial states"
    wanted = "updates with counts, from the filter's initial states on"
    fix = "record from the port, or write output_mode=record, then order=8"
    require(bool(begins.any()), source, wanted, found, fix)
    first = int(np.argmax(begins))
    filter = np.array([u.filter for u in updates])
    ends = np.flatnonzero((~has_counts | (filter != filter[first]))[first:])
    last = first + int(ends[0]) if len(ends) else len(updates)
    rows, number = updates[first:last], np.asarray(numbers[first:last])
    notes = []
    if last < len(updates):
        what = "the filter changes" if has_counts[last] else "the counts end"
        notes.append(f"the record ends after {last - first} rows, where {what}")
    gaps = np.flatnonzero(np.diff(number) != 1)
    if len(gaps):
        notes.append(f"an update is missing after row {gaps[0] + 1}: replay is exact up to there")
    program, names = described.programs[filter[first]], {r.name for r in described.registers}
    registers = [w.name for w in program.inputs if f"feed_{w.name}" in names]
    wanted = "a filter whose inputs all come from the sensors"
    found = f"input registers {', '.join(registers)}"
    require(not registers, f"--log, {program.program}", wanted, found, "record another filter")
    sensed = [u.sensed for u in rows if u.sensed is not None]
    stamp, flags = np.array([(u.stamp, u.flags) for u in rows], dtype=np.int64).T
    counts, line, words = (
        np.array([getattr(s, name) for s in sensed]) for name in ("counts", "line", "outputs")
    )
    used, is_counts = _flag(rows, "field_used"), _flag(rows, "field_counts")
    kind = np.where(used, np.where(is_counts, COUNTS, HEADING), NO_LINE)
    asked, number_of = _flag(rows, "restart_asked"), np.full(len(rows), filter[first])
    front = []
    for name in FRONT_NAMES:
        estimator = FRONT[name]()
        values = described.parameters_of(name, written)
        front.append(with_params(estimator.compile(word=32), estimator, values))
    inputs, field = calibrated(front, Samples(stamp, counts, kind, line, asked, number_of))
    tick_s = described.parameters_of(FRONT_NAMES[0], written)["tick_s"]
    ticks = np.cumsum(np.diff(stamp, prepend=stamp[0]) % 2**32)
    columns = {"t": Column(ticks * tick_s, "s"), **_columns(front[0], inputs)}
    for name, column in _columns(front[1], field).items():
        columns[name] = Column(np.where(used, column.values, np.nan), column.unit)
    for k, out in enumerate(program.outputs):
        columns[f"{out.name}{TRUTH}"] = Column(words[:, k] * 2.0**-out.frac, out.unit)
    raw = {"number": number, "stamp": stamp, "flags": flags}
    raw |= dict(zip(_RAW, counts.T, strict=True))
    for names_of, of, unit in ((_FIELD, COUNTS, 1.0), (_ANGLES, HEADING, 0.1)):
        raw |= dict(zip(names_of, np.where(kind == of, line.T * unit, np.nan), strict=True))
    restart = _flag(rows, "initial_states")
    if restart[1:].any():
        raw["restart"] = restart & (np.arange(len(rows)) > 0)
    columns |= {name: Column(values.astype(float)) for name, values in raw.items()}
    return Record(source, columns), notes


def _columns(program: Program, words: IntArray) -> dict[str, Column]:
    """Outputs of a program, by name."""
    outputs = zip(FRONT[program.name].outputs, program.outputs, words.T, strict=True)
    return {o.name: Column(program.format(k).real(w), o.unit) for o, k, w in outputs}


def static_noise(record: Record) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Mean (3,) and variance (3,) of gyro, accelerometer and magnetometer of a board at rest.

    The paper's Table 2 (Ma Long et al. 2014): rad/s, m/s^2 and uT, in body axes, less a straight
    line over time (warming). The gyro's mean is its bias. NaN with fewer than 3 samples.
    """
    out = {}
    for letter, name in (("g", "gyro"), ("a", "accelerometer"), ("m", "magnetometer")):
        values = np.column_stack([record.numbers(f"{letter}{a}") for a in "xyz"])
        new = np.isfinite(values).all(axis=1)
        at, x = record.numbers("t")[new], values[new]
        out[name] = (np.full(3, np.nan), np.full(3, np.nan))
        if len(x) > 2:
            line = np.column_stack([np.ones(len(x)), at - at.mean()])
            fit = np.linalg.lstsq(line, x, rcond=None)[0]
            out[name] = (fit[0], np.square(x - line @ fit).sum(axis=0) / (len(x) - 2))
    return out


#: Most bits per second.
_BAUD_MOST = 100_000_000
#: Longest command to the compass: with its line end as many bytes as wait on the board.
_LINE_MOST = 14
#: Writes that begin a record.
_RECORDING = ("output_divider=1", "output_mode=record", f"order={INITIAL_STATES.mask}")


@dataclass(frozen=True)
class Track:
    """Updates in time.

    ``number`` goes on behind 65535. ``gaps`` holds, for each place after which frames are missing,
    the index of the update before and how many.
    """

    updates: tuple[Update, ...]
    number: tuple[int, ...]
    time_s: tuple[float, ...]
    gaps: tuple[tuple[int, int], ...]

    @property
    def missing(self) -> int:
        """Frames that did not come."""
        return sum(count for _, count in self.gaps)


@dataclass(frozen=True)
class RegisterWord:
    """A register as it was read."""

    word: int  #: its 32 bits
    value: Any  #: what they mean by the register map; of a status its fields by name
    unit: str

    def __str__(self) -> str:
        value = self.value
        if isinstance(value, dict):
            shown = ", ".join(f"{k} {v}" for k, v in value.items())
        else:
            shown = f"{value:.9g}" if isinstance(value, float) else str(value)
        return f"{shown} {self.unit}".rstrip() + f"  (0x{self.word:08x})"


def track_of(updates: Sequence[Update], *, clock_hz: float) -> Track:
    """Put updates in a row. The commonest step of the numbers is the one without a gap."""
    number, ticks = (
        np.cumsum(np.diff(values, prepend=values[:1]) % modulus)
        for values, modulus in (
            (np.array([u.number for u in updates], dtype=np.int64), 2**16),
            (np.array([u.stamp for u in updates], dtype=np.int64), 2**32),
        )
    )
    steps = np.diff(number).tolist()
    usual = max(1, Counter(steps).most_common(1)[0][0]) if steps else 1
    gaps = tuple((k, (step - 1) // usual) for k, step in enumerate(steps) if step > usual)
    first = updates[0].number if updates else 0
    times = tuple((ticks / clock_hz).tolist())
    return Track(tuple(updates), tuple((number + first).tolist()), times, gaps)


def update_line(update: Update) -> str:
    """One line for people."""
    v, notes = update.values, ", ".join(update.flag_names)
    shown = "  ".join(f"{name} {value:+.6g}" for name, value in v.items())
    if update.is_attitude:
        status = f"{int(v['status']):02X}" if "status" in v else "--"
        shown = (
            f"heading {v['heading_deg']:+8.2f}  pitch {v['pitch_deg']:+7.2f}"
            f"  roll {v['roll_deg']:+8.2f}  filter {update.filter}  status {status}"
        )
    return f"{update.number:5d}  {shown}" + (f"  {notes}" if notes else "")


def _csv(track: Track) -> str:
    """The track as CSV; what is not known is empty."""
    names = dict.fromkeys(name for update in track.updates for name in update.values)
    rows = [",".join(["number", "time_s", *names, "flags"])]
    for number, time_s, update in zip(track.number, track.time_s, track.updates, strict=True):
        cells = {name: f"{value:.10g}" for name, value in update.values.items()}
        if update.is_attitude and "status" in cells:
            cells["status"] = f"0x{int(update.values['status']):02x}"
        values = [cells.get(name, "") for name in names]
        rows.append(",".join([str(number), f"{time_s:.8f}", *values, f"0x{update.flags:04x}"]))
    return "\n".join(rows) + "\n"


def _picture(track: Track, kind: str) -> bytes:
    """An image of heading, pitch and roll over time; missing frames are grey."""
    good = all(update.is_attitude for update in track.updates)
    require(good, "--output", "attitudes", "other outputs", "leave it out, or name a .csv")
    times = np.array(track.time_s)
    holes = [index for index, _ in track.gaps]
    with settings():
        figure, axes = figure_and_axes(5.6, 3, 1, sharex=True)
        for axis, name in zip(axes, ("heading", "pitch", "roll"), strict=True):
            values = np.array([update.values[f"{name}_deg"] for update in track.updates])
            # The line is broken at gaps and where an angle wraps.
            wraps = np.flatnonzero(np.abs(np.diff(values)) > 180.0)
            breaks = np.union1d(wraps, holes).astype(int) + 1
            single = {"marker": "."} if len(values) < 3 else {}
            for index, _ in track.gaps:
                axis.axvspan(
                    times[index], times[index + 1], color=COLOUR["grey"], alpha=0.35, linewidth=0.8
                )
            axis.plot(
                np.insert(times, breaks, np.nan),
                np.insert(values, breaks, np.nan),
                color=COLOUR[name],
                **single,
            )
            axis.set_ylabel(f"{name} [deg]")
        note = f"{len(track.updates)} attitudes"
        if track.missing:
            note += f", {track.missing} missing (grey)"
        axes[0].set_title(note, loc="left", color=INK, fontsize=9.0)
        axes[-1].set_xlabel("time since the first [s]")
        image = io.BytesIO()
        figure.savefig(image, format=kind, dpi=130)
    return image.getvalue()


def _assignment(text: str) -> tuple[str, str]:
    name, separator, value = text.partition("=")
    good = bool(separator and name and value)
    require(good, "--write", "NAME=VALUE", text, "for example --write filter=mekf")
    return name, value


def _values(text: str) -> Iterator[tuple[str, str]]:
    """Registers of an ``@FILE`` of parameters, by program."""
    path = text[1:]
    data = read_json(path, "a file of parameters")
    programs: Any = data.get("parameters") if isinstance(data, dict) else None
    is_map = isinstance(data, dict) and "registers" in data
    found = "a register map" if is_map else kind_of(data)
    good = isinstance(programs, dict) and all(isinstance(v, dict) for v in programs.values())
    wanted = "parameters of programs, as boresight fit board writes them"
    fix = "give such a file, or write NAME=VALUE; a register map is for --map"
    require(good, path, wanted, found, fix)
    for program, some in programs.items():
        yield from ((f"{program}.{name}", repr(value)) for name, value in some.items())


def _check_build(line: BoardLine, table: RegisterTable) -> None:
    """Refuse a register map of another bitstream than the board's."""
    for name in ("system_build_low", "system_build_high"):
        register = table.find(name)
        word = line.access(Kind.READ, [register.address]) & 0xFFFF_FFFF
        wanted = f"the map of the board's bitstream, whose {name} is 0x{word:08x}"
        fix = "give the registers.json that was written with the bitstream"
        found = f"one with 0x{register.reset or 0:08x}"
        require(word == register.reset, f"--map {table.path}", wanted, found, fix)


def _words(table: RegisterTable, writes: Sequence[str]) -> list[tuple[Register, int]]:
    """Registers to write, and what."""
    pairs = (_values(text) if text[:1] == "@" else [_assignment(text)] for text in writes)
    to_write = [(table.find(name), value) for name, value in chain.from_iterable(pairs)]
    words = []
    for register, value in to_write:
        is_line = register.name == "compass_command" and value[0] in "*#"
        good = not is_line or (value.isascii() and len(value) <= _LINE_MOST)
        wanted = f"a command of up to {_LINE_MOST} ASCII characters"
        require(good, f"--write {register.name}", wanted, value, "shorten it")
        texts = [str(0x100 | ord(c)) for c in f"{value}\r\n"] if is_line else [value]
        words += [(register, word_of(register, text)) for text in texts]
    return words


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

    The parameters are those of `boresight.monitor`. For ``log`` a port is told to send every update
    with its counts, from the filter's initial states on, and attitudes alone afterwards.
    """
    require(count is None or count >= 1, "--steps", "1 or more", count)
    require(1 <= baud <= _BAUD_MOST, "--baud", f"1 to {_BAUD_MOST:,}", baud)
    suffix = None if plot is None else Path(plot).suffix
    good, wanted = suffix in (None, ".png", ".svg", ".pdf"), "a name with .csv, .png, .svg or .pdf"
    require(good, "--output", wanted, str(plot), "give such a name")
    wanted, fix = "a file of its own for each output", "choose another with --log"
    taken = {os.path.realpath(path) for path in (csv, plot) if path is not None} - {os.devnull}
    good = log is None or os.path.realpath(log) not in taken
    require(good, str(log), wanted, "the same file as --output", fix)
    inputs = [source] if register_map is None else [source, register_map]
    table_file, log_file, picture_file = (
        None if path is None else OutputFile(path, inputs=inputs, option=option)
        for path, option in ((csv, "--output"), (log, "--log"), (plot, "--output"))
    )
    if log is not None:
        check_written(log)
    table = RegisterTable(register_map)
    words, to_read = _words(table, writes), [table.find(name) for name in reads]
    for register in to_read:
        good, found = register.access is not Access.WRITE_ONLY, "one that can be written only"
        where = f"--read {register.name}"
        require(good, where, "a register that can be read", found, "choose another")
    keep = any(path is not None for path in (csv, log, plot))
    came, failures = list[tuple[Update, float]](), list[str]()
    listener = Listener(table.formats)
    with BoardLine(source, baud=baud, listener=listener) as line:

        def write(words: Sequence[tuple[Register, int]]) -> None:
            for register, word in words:
                line.access(Kind.WRITE, [register.address, word])

        write(words)
        registers = {}
        for register in to_read:
            word = line.access(Kind.READ, [register.address])
            value = value_of(register, word)
            registers[register.name] = RegisterWord(word & 0xFFFF_FFFF, value, register.unit)
        recording = log is not None and line.is_port
        if recording:
            _check_build(line, table)
            write(_words(table, _RECORDING))
        if keep or count is not None or not (reads or writes):
            try:
                with suppress(KeyboardInterrupt):
                    for item in line.items(silence_s=silence_s):
                        if isinstance(item, Update):
                            came.append((item, time.monotonic()))
                            if each is not None:
                                each(update_line(item))
                        if count is not None and len(came) >= count:
                            break
            except InputError as error:  # what came is kept
                if not (keep and came):
                    raise
                failures.append(f"ended after {len(came)} attitudes: {error}")
        if recording and not failures:
            write(_words(table, ["output_mode=binary"]))
        updates, bad = [update for update, _ in came], listener.error_count
        good = bool(updates) or (picture_file is None and line.is_port)
        others = f"none, and {bad:,} damaged pieces" if bad else None
        fix = "check --baud and register output_mode, and that this came from the board"
        if not (good or line.is_port):  # bytes as words: the width of a record's is not known
            kinds = [kind for kind, _ in Decoder(word=8).feed(Path(source).read_bytes())]
            if records := kinds.count(Kind.RECORD):
                others = f"{records:,} records of a core that a computer feeds (--top records)"
                fix = "README.txt of its board project has a program that reads them"
        require(good, source, "frames with attitudes", others, fix)
    track = track_of(updates, clock_hz=table.clock_hz)
    if table_file is not None:
        table_file.write(_csv(track))
    if picture_file is not None and suffix is not None:
        picture_file.write(_picture(track, suffix[1:]))
    written = {r.name: word & 0xFFFF_FFFF for r, word in words}
    notes: list[str] = []
    if log_file is not None and log is not None:
        record, notes = log_of(source, updates, track.number, table.described, written)
        if line.is_port:
            at = dict(zip(track.number, (heard for _, heard in came), strict=True))
            times = np.array([at[int(n)] for n in record.numbers("number")])
            record = record.derived({**record.columns, "computer": Column(times, "s")})
        log_file.write(content_of(log, record))
    lines = [f"{name} = 0x{word:08x} written" for name, word in written.items()]
    lines += [f"{name} = {register}" for name, register in registers.items()]
    if updates or not lines:
        lines += [f"{len(updates)} attitudes, {track.missing} missing, {bad} frames damaged"]
    data = {
        "attitudes": updates,
        "missing": track.missing,
        "bad": bad,
        "written": written,
        "registers": registers,
    }
    return Result(data, summary="\n".join(lines), notes=notes, failures=failures)
