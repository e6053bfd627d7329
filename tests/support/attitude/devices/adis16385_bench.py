"""Run of the ADIS16385's reader against the device model, compiled: what happened, as records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from boresight.gateware.attitude.sensors.adis16385 import FLAG_MEANINGS, Adis16385, Timing
from boresight.gateware.synthesis.tools import to_verilog
from boresight.sim.attitude.devices import INERTIAL_FAULTS, device_text
from boresight.sim.rtl.simulators import build

#: A reader whose waits are short, for simulation: half period 3 cycles, stall 30, a sample each
#: 2000 cycles.
SCALED: Final[Mapping[str, float]] = {
    "sclk_hz": 1e6 / 6,
    "stall_s": 30e-6,
    "startup_s": 3e-3,
    "reset_s": 100e-6,
    "self_test_s": 0.0,
    "period_s": 2e-3,
}
#: Cycles between its samples.
PERIOD: Final = 2000


@dataclass(frozen=True)
class Sample:
    """A good sample.

    Attributes
    ----------
    time : int
        Cycle of ``sample``.
    stamp, number : int
        As the reader says.
    line : int
        Line of the log that the device had at the data-ready edge, from 1 on.
    words : tuple of int
        Signed words, in counts of +-300 deg/s.
    """

    time: int
    stamp: int
    number: int
    line: int
    words: tuple[float, ...]


@dataclass(frozen=True)
class Happened:
    """All that was seen at the pins and at the reader.

    Attributes
    ----------
    samples : list of Sample
        Good samples.
    events : list of (int, frozenset of str)
        Cycle, events in it.
    flags : list of (int, frozenset of str)
        Cycle, flags from then on.
    latest : list of (int, int, int)
        Cycle, temperature and DIAG_STAT from then on, signed; both are 0 at first.
    edges, frames, resets : list of int
        Cycles of data-ready edges, ends of frames, changes of the reset pin (it is low at first).
    violations : int
        Timing rules broken at the device's pins, as the device says; ``complaints`` has the lines.
    """

    samples: list[Sample] = field(default_factory=list)
    events: list[tuple[int, frozenset[str]]] = field(default_factory=list)
    flags: list[tuple[int, frozenset[str]]] = field(default_factory=list)
    latest: list[tuple[int, int, int]] = field(default_factory=list)
    edges: list[int] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)
    resets: list[int] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    violations: int = 0

    def times(self, event: str) -> list[int]:
        """Cycles of an event."""
        return [time for time, names in self.events if event in names]

    def flags_at(self, time: int) -> frozenset[str]:
        """Flags in a cycle."""
        return next((names for at, names in reversed(self.flags) if at <= time), frozenset())


def scaled_reader(**changes: Any) -> Adis16385:
    """The reader for simulation: `SCALED`, with changes of timing or ``bad_limit``."""
    limit = {k: changes.pop(k) for k in {"bad_limit"} & changes.keys()}
    return Adis16385(clock_hz=1e6, timing=Timing(**{**SCALED, **changes}), **limit)


def log_text(samples: Iterable[Sequence[int]]) -> str:
    """The device's log: lines of 6 counts, temperature, DIAG_STAT."""
    return "".join(" ".join(str(int(word)) for word in words) + "\n" for words in samples)


class ReaderBench:
    """Reader and device, connected and built.

    Parameters
    ----------
    reader : Adis16385, optional
        `scaled_reader` by default.
    parameters : mapping, optional
        Of the device (see ``adis16385_bench.sv``).
    cache : Path, optional
        Folder for builds.
    """

    def __init__(
        self,
        reader: Adis16385 | None = None,
        *,
        parameters: Mapping[str, int] | None = None,
        cache: Path | None = None,
    ) -> None:
        self.reader = reader or scaled_reader()
        self._bench = build(
            "adis16385_bench",
            {
                "reader.v": to_verilog(self.reader, "adis16385", instances=False),
                "device.sv": device_text("adis16385"),
                "bench.sv": Path(__file__).with_name("adis16385_bench.sv").read_text(),
            },
            parameters=parameters,
            cache=cache,
        )

    def run(
        self,
        *,
        samples: int | None = None,
        cycles: int | None = None,
        log: Iterable[Sequence[int]] | None = None,
        faults: Sequence[tuple[int, int, str]] = (),
        fault: tuple[str, int, int] | None = None,
        restart: int | None = None,
        settings: tuple[int, int, int] | None = None,
        command: tuple[int, int] | None = None,
        self_test: int = 0,
    ) -> Happened:
        """Let them run.

        Parameters
        ----------
        samples, cycles : int, optional
            Where to end; at least one of them.
        log : iterable of 8 words, optional
            What the device measures; by default a pattern in which each word differs.
        faults : sequence of (first, last, name)
            Faults by sample instants.
        fault : (name, from, to), optional
            Fault by cycles.
        restart : int, optional
            Cycle of a restart.
        settings : (int, int, int), optional
            msc_ctrl, smpl_prd, sens_avg.
        command : (int, int), optional
            Cycle and frame of a command.
        self_test : int
            Bits of DIAG_STAT that a self-test sets.
        """
        limit = cycles if cycles is not None else 1000 * PERIOD + 100 * (samples or 0) * PERIOD
        plusargs: dict[str, object] = {
            "adis_log": "log.txt",
            "adis_faults": "faults.txt",
            "cycles": limit,
            "adis_self_test": f"{self_test:x}",
        }
        if samples is not None:
            plusargs["samples"] = samples
        if restart is not None:
            plusargs["restart"] = restart
        if settings is not None:
            plusargs["settings"] = "".join(f"{word:04x}" for word in settings)
        if command is not None:
            plusargs["command_at"], plusargs["command"] = command[0], f"{command[1]:04x}"
        if fault is not None:
            name, plusargs["fault_from"], plusargs["fault_to"] = fault
            plusargs["fault"] = f"{1 << INERTIAL_FAULTS.index(name):x}"
        if log is None:
            log = ([100 * k + n for n in range(6)] + [k, 0] for k in range(1, 300))
        run = self._bench.run(
            plusargs,
            max_cycles=limit + 100,
            files={
                "log.txt": log_text(log),
                "faults.txt": "".join(
                    f"{a} {b} {INERTIAL_FAULTS.index(name)}\n" for a, b, name in faults
                ),
            },
        )
        return _read(run.stdout)


def _read(text: str) -> Happened:
    happened = Happened()
    violations = -1
    for line in text.splitlines():
        head, *rest = line.split()
        if head == "adis16385:":
            happened.complaints.append(line)
        elif head == "end":
            violations = int(rest[2])
        elif head.isdigit():
            _record(happened, int(head), rest[0], rest[1:])
    return Happened(**{**vars(happened), "violations": violations})


def _record(happened: Happened, time: int, kind: str, rest: list[str]) -> None:
    if kind == "S":
        words = tuple(_signed(word, 18) / 4 for word in rest[3:])
        stamp, number, log_line = (int(word) for word in rest[:3])
        happened.samples.append(Sample(time, stamp, number, log_line, words))
    elif kind == "E":
        happened.events.append((time, _names(rest[0], Adis16385.EVENTS)))
    elif kind == "L":
        happened.latest.append((time, _signed(rest[0]), _signed(rest[1])))
    elif kind == "F":
        happened.flags.append((time, _names(rest[0], tuple(FLAG_MEANINGS))))
    else:
        {"D": happened.edges, "C": happened.frames, "R": happened.resets}[kind].append(time)


def _signed(digits: str, bits: int = 16) -> int:
    sign = 1 << bits - 1
    return (int(digits, 16) ^ sign) - sign


def _names(digits: str, names: tuple[str, ...]) -> frozenset[str]:
    word = int(digits, 16)
    return frozenset(name for k, name in enumerate(names) if word >> k & 1)
