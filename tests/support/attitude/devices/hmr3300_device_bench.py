"""The HMR3300's reader and the model of the compass, compiled: what happens by a script."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from boresight.gateware.attitude.sensors.hmr3300 import FLAGS, LINES_HZ, Hmr3300
from boresight.gateware.synthesis.tools import to_verilog
from boresight.sim.attitude.devices import COMPASS_FAULTS, device_text
from boresight.sim.rtl.simulators import Compiled, build

#: Cycles of a bit in these runs; all times of the device and the reader are the real ones.
_BIT = 8
#: Clock of these runs.
CLOCK_HZ = 19_200 * _BIT
#: From sentence to sentence.
LINE_CYCLES = round(CLOCK_HZ / LINES_HZ)

_MODE, _COMMAND, _FAULTS, _END = range(4)


@dataclass(frozen=True)
class Line:
    """A sentence that the reader took.

    Attributes
    ----------
    time : float
        s.
    is_counts : bool
        Its kind.
    values : tuple of int
        Tenths of a degree, or counts.
    slot : int
        The device's slot: the line of the data, from 0 on.
    """

    time: float
    is_counts: bool
    values: tuple[int, ...]
    slot: int


@dataclass(frozen=True)
class Happened:
    """All of a run.

    Attributes
    ----------
    lines : list of Line
        Sentences.
    events : list of (time, name)
        As in `Hmr3300.EVENTS`.
    flags : list of (time, set of names)
        Each change.
    """

    lines: list[Line]
    events: list[tuple[float, str]]
    flags: list[tuple[float, frozenset[str]]]

    def times(self, event: str) -> list[float]:
        """When ``event`` happened."""
        return [time for time, name in self.events if name == event]


def run_reader(
    data: Sequence[Sequence[int]],
    *,
    seconds: float,
    modes: Iterable[tuple[float, int]] = (),
    commands: Iterable[tuple[float, str]] = (),
    faults: Iterable[tuple[float, float, str]] = (),
    slot_faults: Iterable[tuple[int, int, str]] = (),
    ppm: int = 0,
    slower: int = 0,
) -> Happened:
    """Reader and compass for ``seconds`` of simulated time.

    Parameters
    ----------
    data : sequence of 6 integers each
        Heading, pitch, roll in tenths of a degree, three counts; one of these 8 times a second.
    seconds : float
        How long.
    modes : iterable of (time, mode)
        The reader's ``mode`` from a time on.
    commands : iterable of (time, letter)
        Single commands.
    faults : iterable of (begin, end, name)
        As in `FAULTS`.
    slot_faults : iterable of (first, last, name)
        The same by slots of sentences.
    ppm : int
        How much longer the compass's bits are than the reader's, 1e-6.
    slower : int
        How often the rate of the line is halved.
    """
    steps = [(time, _MODE, mode | slower << 2) for time, mode in modes or [(0, 0)]]
    steps += [(time, _COMMAND, ord(letter)) for time, letter in commands]
    faults = list(faults)
    for time in {t for begin, end, _ in faults for t in (begin, end)}:
        active = sum(
            1 << COMPASS_FAULTS.index(name) for begin, end, name in faults if begin <= time < end
        )
        steps.append((time, _FAULTS, active))
    steps.append((seconds, _END, 0))
    run = _bench(slower).run(
        {
            "hmr3300_ppm": ppm,
            "script": "script.txt",
            "hmr3300_data": "data.txt",
            "hmr3300_faults": "faults.txt",
        },
        max_cycles=round(seconds * CLOCK_HZ) + 1000,
        files={
            "script.txt": "".join(
                f"{round(t * CLOCK_HZ)} {what} {value}\n" for t, what, value in sorted(steps)
            ),
            "faults.txt": "".join(
                f"{a} {b} {COMPASS_FAULTS.index(name)}\n" for a, b, name in slot_faults
            ),
            "data.txt": "".join(" ".join(map(str, line)) + "\n" for line in data),
        },
    )
    return _parsed(run.stdout)


@cache
def _bench(slower: int) -> Compiled:
    reader = Hmr3300(clock_hz=CLOCK_HZ)
    return build(
        "hmr3300_device_bench",
        {
            "reader.v": to_verilog(reader, "hmr3300_reader", instances=False),
            "hmr3300.sv": device_text("hmr3300"),
            "bench.sv": (Path(__file__).parent / "hmr3300_device_bench.sv").read_text(),
        },
        parameters={
            "BIT": _BIT << slower,
            "LINE": LINE_CYCLES,
            "STARTUP": round(0.8 * CLOCK_HZ),
            "ANSWER": round(0.001 * CLOCK_HZ),
        },
    )


def _parsed(text: str) -> Happened:
    out = Happened([], [], [])
    names = list(FLAGS)
    for entry in text.splitlines():
        if entry.startswith("-"):  # Verilator says where it finished
            continue
        cycle, what, *rest = entry.split()
        time, numbers = int(cycle) / CLOCK_HZ, [int(n) for n in rest]
        if what == "event":
            out.events.append((time, Hmr3300.EVENTS[numbers[0]]))
        elif what == "line":
            out.lines.append(Line(time, bool(numbers[0]), tuple(numbers[1:4]), numbers[4]))
        else:
            out.flags.append(
                (time, frozenset(n for k, n in enumerate(names) if numbers[0] >> k & 1))
            )
    return out
