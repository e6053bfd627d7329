"""Runs of a log through the simulated board, compared with the chain of integer models."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boresight.gateware.attitude.system.interface import FIELDS, SENSED_WORDS, TAKE_FEED, WORDS
from boresight.gateware.boards.frames import Decoder, Kind, encode
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.attitude import front
from boresight.model.errors import require
from boresight.model.words.fixed import wrap
from boresight.sim.attitude.board.build import Board, board_parameters, board_sources
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Chain, Samples, run_chain
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_to_euler
from boresight.sim.rtl.simulators import SimulationFailed, build


class Line(NamedTuple):
    """A good line of the compass: cycle, whether counts, its three numbers, the device's slot."""

    cycle: int
    counts: bool
    values: tuple[int, int, int]
    slot: int


@dataclass(frozen=True)
class Trace:
    """Events of a run, each with its clock cycle (int64)."""

    #: Cycle in which data-ready rose, and the device's line of the log then, from 1 on: (n, 2).
    ready: IntArray
    #: Cycles in which a sample was in the reader's buffer, and an update in the registers.
    samples: IntArray
    updates: IntArray
    #: Cycle, inertial bits, compass bits: faults of the devices from that cycle on.
    faults: list[tuple[int, int, int]]
    #: Cycle, bits: pulses of the counted events (`AttitudeSystem.events`).
    events: list[tuple[int, int]] = field(repr=False)
    lines: tuple[Line, ...]
    #: Cycle in which the stop bit of each byte to the host began; the bytes.
    bytes_at: IntArray
    data: bytes = field(repr=False)
    #: Bytes to the host without stop bit.
    framing_errors: IntArray
    #: Violations of the device's timing by the reader.
    violations: int


def read_trace(text: str) -> Trace:
    """Read the text of a trace."""
    rows: dict[str, list[list[str]]] = defaultdict(list)
    for line in text.splitlines():
        cycle, kind, *rest = line.split()
        if kind == "X":
            raise SimulationFailed(f"unknown value (X) at the board's pins in cycle {cycle}")
        rows[kind].append([cycle, *rest])
    if not rows["V"]:
        raise SimulationFailed("the board's bench did not come to its end")

    def numbers(kind: str, columns: int) -> IntArray:
        return np.array(rows[kind], dtype=np.int64).reshape(-1, columns)

    return Trace(
        ready=numbers("R", 2),
        samples=numbers("S", 1)[:, 0],
        updates=np.array([int(row[0]) for row in rows["U"]], dtype=np.int64),
        framing_errors=numbers("E", 1)[:, 0],
        faults=[(int(t), int(adis, 16), int(hmr, 16)) for t, adis, hmr in rows["F"]],
        events=[(int(t), int(bits, 16)) for t, bits in rows["N"]],
        lines=tuple(
            Line(int(t), counts == "1", (int(a), int(b), int(c)), int(slot))
            for t, counts, a, b, c, slot in rows["L"]
        ),
        bytes_at=np.array([int(t) for t, _ in rows["B"]], dtype=np.int64),
        data=bytes(int(byte, 16) for _, byte in rows["B"]),
        violations=int(rows["V"][-1][1]),
    )


@dataclass(frozen=True)
class Stimulus:
    """Data of the devices.

    ``counts`` (n, 6) are those of gyro and accelerometer of every sample; ``compass`` (m, 6) holds
    heading, pitch, roll [0.1 deg] and magnetometer x, y, z [counts] of every line; ``halvings`` is
    how often the gyro's range of +-300 deg/s is halved.
    """

    counts: IntArray
    compass: IntArray
    halvings: int = 0

    def files(self) -> dict[str, str]:
        """The devices' logs, by file name."""
        extra = np.tile([37, 0], (len(self.counts), 1))  # TEMP_OUT at 27.5 degC
        tables = {"adis.txt": np.hstack([self.counts, extra]), "hmr.txt": self.compass}
        return {
            name: "".join(" ".join(map(str, row)) + "\n" for row in table.tolist())
            for name, table in tables.items()
        }


def stimulus(record: Record, board: Board, *, halvings: int = 0) -> Stimulus:
    """Return a nine-axis record as the data of both devices: row k is sample k, whatever its time.

    The compass sends headings of the record's attitude.
    """
    log = NineAxis.of(record)
    q, setup = log.attitude, board.setup
    # Time of line k after the first sample.
    period = setup.rate_hz / setup.lines_hz
    first = setup.compass_start_cycles / setup.period_cycles
    rows = np.minimum(
        np.round(first + period * np.arange(1 + len(log) / period)).astype(np.int64), len(log) - 1
    )
    # Each line has the field and the attitude of its time.
    usable = np.flatnonzero(np.isfinite(q).all(axis=1) & log.mag_new)
    wanted = "rows with field and attitude"
    require(len(usable) > 0, f"log {log.name!r}", wanted, None, "use another log")
    rows = usable[np.clip(np.searchsorted(usable, rows, side="right") - 1, 0, None)]
    compass = np.hstack([heading_words(q[rows]), field_words(log.mag[rows])])
    return Stimulus(inertial_words(log, halvings), compass, halvings)


def writes(board: Board, values: Mapping[str, int], *, start: int = 2_000) -> str:
    """Return the host file of the bench: writes of registers by name, in order, from a cycle on.

    Words of input registers (``feed_NAME``) come last, then the order that activates them.
    """
    registers = board.system.map()
    divisor = board_parameters(board.setup)["HOST_DIVISOR"]
    out, cycle = [], start
    pairs = sorted(values.items(), key=lambda pair: pair[0].startswith("feed_"))
    if pairs and pairs[-1][0].startswith("feed_"):
        # No sample is used before the set of input registers is complete.
        pairs = [("run", 0), *pairs, ("order", TAKE_FEED.mask), ("run", 1)]
    for name, value in pairs:
        words = registers.find(name).address, wrap(value, 32)
        for byte in encode(Kind.WRITE, words, word=32):
            out.append(f"{cycle} {byte:02x}\n")
            cycle += 10 * divisor
        cycle += 40 * 10 * divisor  # the reply
    return "".join(out)


@dataclass(frozen=True)
class BoardRun:
    """Result of a run.

    ``frames`` (n, 2 + outputs) are the signed words of the frames
    (`gateware.attitude.system.interface`), ``frame_ends`` (n,) the cycles of their last bytes,
    ``dropped`` counts damaged ones.
    """

    trace: Trace
    frames: IntArray
    frame_ends: IntArray
    dropped: int


def frames_of(trace: Trace) -> tuple[IntArray, IntArray, int]:
    """Frames, their ends, and the number of damaged ones; see `BoardRun`."""
    decoder, words = Decoder(word=32), list[tuple[int, list[int]]]()
    for cycle, byte in zip(trace.bytes_at.tolist(), trace.data, strict=True):
        for kind, w in decoder.feed(bytes([byte])):
            if kind >= Kind.ATTITUDE:
                words.append((cycle, w[:-SENSED_WORDS] if kind is Kind.SENSED else w))
    width = len(words[0][1]) if words else len(WORDS)
    complete = [(cycle, w) for cycle, w in words if len(w) == width]
    frames = np.array([w for _, w in complete], dtype=np.int64).reshape(-1, width)
    ends = np.array([cycle for cycle, _ in complete], dtype=np.int64)
    return frames, ends, decoder.dropped + len(words) - len(complete)


def run_board(
    board: Board,
    stimulus: Stimulus,
    *,
    updates: int,
    settings: Mapping[str, int],
    faults: Mapping[str, str] | None = None,
    orders: Mapping[int, int] | None = None,
    max_cycles: int | None = None,
) -> BoardRun:
    """Run the compiled bench until so many updates are done.

    ``settings`` are registers that the host writes first, by name; ``faults`` texts of the devices'
    fault files, "adis" and "hmr"; ``orders`` words that the host writes to register ``order``
    later, by the cycle.
    """
    files, arguments = files_and_arguments(board, stimulus, updates, settings, faults or {})
    for cycle, word in (orders or {}).items():
        files["host.txt"] += writes(board, {"order": word}, start=cycle)
    limit = max_cycles or cycles_limit(board, updates)
    bench = build("bench", board_sources(board), parameters=board_parameters(board.setup))
    with tempfile.TemporaryDirectory(prefix="boresight-board-") as folder:
        bench.run(arguments, max_cycles=limit, files=files, folder=Path(folder))
        trace = read_trace((Path(folder) / "trace.txt").read_text())
    return BoardRun(trace, *frames_of(trace))


def cycles_limit(board: Board, updates: int) -> int:
    """Cycles after which a run counts as hung."""
    start = board.setup.clock_hz * (board.setup.timing.startup_s + 0.01)
    return int(1.5 * (updates + 50) * board.setup.period_cycles + 20 * start)


def files_and_arguments(
    board: Board,
    stimulus: Stimulus,
    updates: int,
    settings: Mapping[str, int],
    faults: Mapping[str, str],
) -> tuple[dict[str, str], dict[str, object]]:
    """Files of a run by name, and the plusargs of the bench."""
    files = {
        **stimulus.files(),
        "host.txt": writes(board, settings),
        **{f"{device}_faults.txt": text for device, text in faults.items()},
    }
    names = {"host": "host", "adis": "adis_log", "hmr": "hmr3300_data"}
    names |= {"adis_faults": "adis_faults", "hmr_faults": "hmr3300_faults"}
    arguments = {names[file.removesuffix(".txt")]: file for file in files}
    return files, {"updates": updates, **arguments}


@dataclass(frozen=True)
class Judgement:
    """Comparison of a run with the chain of integer models, on the data at the devices' pins.

    Cycles are (least, most).
    """

    updates: int  #: compared
    mismatches: int  #: words that differ: stamp, outputs, parts of the header; lines of the compass
    first: str  #: description of the first mismatch; empty without one
    lost: int  #: data-ready edges, from the first sample's to the last one's, without a sample
    fields: int  #: updates with a fresh field
    lines: int  #: good lines of the compass
    transfer_cycles: tuple[int, int]  #: from data-ready to the sample
    core_cycles: tuple[int, int]  #: from the sample to the new attitude
    frame_end_cycles: tuple[int, int]  #: from data-ready to the last bit of the frame
    chain: Chain  #: results of the models


#: Kinds of lines by magnetic source.
_KINDS = ((), (COUNTS,), (HEADING,), (COUNTS, HEADING))


def judge(
    board: Board,
    stimulus: Stimulus,
    run: BoardRun,
    *,
    filter: int,
    source: int,
    feed: Mapping[str, int] | None = None,
) -> Judgement:
    """Compare every frame of a run without faults, word by word.

    ``feed`` has the words of the input registers, by input.

    The models process the rows of the devices' logs, by the number of the data-ready edge and the
    slot of the compass's line. The cycle of a line decides its update: the one after the next that
    is complete.
    """
    names = board.core.parts[filter].program.output_names
    trace, n = run.trace, len(run.trace.updates)
    frames = run.frames if len(run.frames) else np.zeros((0, 2 + len(names)), dtype=np.int64)
    if n == 0 or len(trace.samples) < n:
        raise ValueError(f"run must have updates, not {n} of {len(trace.samples)} samples")
    edge = np.searchsorted(trace.ready[:, 0], trace.samples[:n]) - 1
    ready, row = trace.ready[edge].T
    problems = []
    kinds, values = np.full(n, NO_LINE), np.zeros((n, 3), dtype=np.int64)
    for line in trace.lines:
        kind = COUNTS if line.counts else HEADING
        sent = stimulus.compass[min(line.slot, len(stimulus.compass) - 1)]
        sent = sent[3:] if line.counts else sent[:3]
        if tuple(sent) != line.values:
            problems.append(f"compass line in cycle {line.cycle}: {line.values}, sent {sent}")
        update = int(np.searchsorted(trace.updates, line.cycle)) + 1
        if kind in _KINDS[source] and update < n:
            kinds[update], values[update] = kind, sent
    scale = 2.0 ** -np.array([stimulus.halvings] * 3 + [0] * 3)
    samples = Samples(
        ready % (1 << 32),
        stimulus.counts[np.minimum(row - 1, len(stimulus.counts) - 1)] * scale,
        kinds,
        values,
        np.arange(n) == 0,
        np.full(n, filter),
        feed or {},
    )
    chain = run_chain([part.program for part in board.core.parts], samples)
    k = (frames[:, 0] & FIELDS["number"].mask) - 1
    offset = frames[0, 1] - samples.stamp[k[0]] if len(k) else 0
    expected = {
        "stamp": (samples.stamp[k] + offset) % (1 << 32),
        **dict(zip(names, chain.outputs[k].T, strict=False)),
        "filter": samples.filter[k],
        "field_used": samples.line[k] != NO_LINE,
        "field_counts": samples.line[k] == COUNTS,
        "restart": chain.restart[k],
        "saturated": chain.saturated[k],
        "beyond": chain.beyond[k],
    }
    computed = {
        "stamp": frames[:, 1] % (1 << 32),
        **dict(zip(names, frames[:, 2:].T, strict=True)),
        **{name: field.of(frames[:, 0]) for name, field in FIELDS.items()},  # type: ignore[arg-type]
    }
    wrong = [(k[i], n, i) for n, e in expected.items() for i in np.flatnonzero(computed[n] != e)]
    problems += [
        f"update {at}, {n}: {computed[n][i]} instead of {int(expected[n][i])}"
        for at, n, i in sorted(wrong)
    ]
    if not len(frames):
        problems.append("no attitude frame came")
    return Judgement(
        n if len(frames) else 0,
        len(problems),
        problems[0] if problems else "",
        int(edge[-1] - edge[0]) + 1 - n,
        int((kinds != NO_LINE).sum()),
        len(trace.lines),
        _range(trace.samples[:n] - ready),
        _range(trace.updates - trace.samples[:n]),
        _range(run.frame_ends - ready[k]),
        chain,
    )


def _range(values: IntArray) -> tuple[int, int]:
    return (int(values.min()), int(values.max())) if len(values) else (0, 0)


def inertial_words(log: NineAxis, halvings: int = 0) -> IntArray:
    """Counts (n, 6) of gyro and accelerometer; +-300 deg/s is halved ``halvings`` times."""
    gyro = _counts(log.gyr, front.GYRO_SCALE / 2**halvings, front.GYRO_COUNTS)
    return np.column_stack([gyro, _counts(log.acc, front.ACC_SCALE, front.ACC_COUNTS)])


def field_words(mag: FloatArray) -> IntArray:
    """Counts (n, 3) of the compass for fields [uT]."""
    return _counts(mag, front.FIELD_SCALE, 32767)


def heading_words(q: FloatArray) -> IntArray:
    """Tenths of a degree (n, 3) of the compass for attitudes (n, 4): heading, pitch, roll."""
    pitch, roll, heading = quaternion_to_euler(q).T / np.pi
    angles = np.rint(np.stack([-heading, pitch, roll], axis=1) / front.TENTH_HT).astype(np.int64)
    angles[:, 0] %= 3600
    return angles


def _counts(value: FloatArray, scale: float, limit: int) -> IntArray:
    return np.clip(np.rint(value / scale), -limit, limit).astype(np.int64)
