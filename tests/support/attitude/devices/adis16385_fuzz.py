"""Fuzz of the ADIS16385's reader: any answers, any data-ready, resets; judged by its contract."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from boresight.gateware.attitude.sensors.adis16385_flags import EVENTS, FLAG_MEANINGS
from boresight.gateware.verilog import to_verilog
from boresight.sim.rtl.compiled import build
from tests.support.attitude.devices.adis16385_bench import PERIOD, scaled_reader
from tests.support.attitude.devices.adis16385_contract import Contract, ContractBroken

#: Order of records of one cycle: settings are seen before whatever takes them; outputs that the
#: model takes from the trace come in the cycle after their cause.
_ORDER = {"s": 0, "d": 3, "c": 2, "f": 1, "r": 2, "E": 2, "x": 5, "e": 6, "F": 9, "S": 9}


@dataclass(frozen=True)
class FuzzResult:
    """What a run was made of; all of it agreed with the contract.

    Attributes
    ----------
    frames, cycles : int
        Length.
    events : dict
        How often each event came.
    edges : int
        Data-ready edges at the pin.
    cycles_per_s : float
        Speed of the simulation.
    """

    frames: int
    cycles: int
    events: dict[str, int]
    edges: int
    cycles_per_s: float


def fuzz(frames: int, *, seed: int = 1, cache: Path | None = None) -> FuzzResult:
    """Run the reader for ``frames`` frames against a device that does whatever it likes.

    Raises
    ------
    ContractBroken
        The reader did something else than its contract says; the message has the cycle.
    SimulationFailed
        The run did not end: the reader hung.
    """
    reader = scaled_reader()
    spi = reader.spi
    bench = build(
        "adis16385_fuzz",
        {
            "reader.v": to_verilog(reader, "adis16385", instances=False),
            "bench.sv": Path(__file__).with_name("adis16385_fuzz.sv").read_text(),
        },
        parameters={
            "HALF": spi.half_cycles,
            "SETUP": spi.setup_cycles,
            "STALL": spi.stall_cycles,
            "HOLD": reader.hold_cycles,
            "PERIOD": PERIOD,
        },
        cache=cache,
    )
    run = bench.run({"frames": frames, "seed": seed}, max_cycles=100_000 + 2_000 * frames)
    lines = run.stdout.splitlines()
    events = judge(lines, Contract(reader, (0x0006, 0x0001, 0x0402)))
    return FuzzResult(
        frames,
        run.cycles,
        events,
        sum(" d" in line for line in lines),
        run.cycles / max(run.seconds, 1e-9),
    )


def _records(lines: Iterable[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Records in the order in which the reader sees them: data-ready edges late."""
    results: list[tuple[int, int, int, int, str, list[str]]] = []
    for line in lines:
        head, *rest = line.split()
        if head == "violation:":
            raise ContractBroken(line)
        if head.isdigit() and rest:
            time = int(head)
            # Causes at the time at which they take effect; outputs at the time of their cause.
            shift = {"d": 2, "f": 1, "c": -1, "r": -2, "E": -1}.get(rest[0], 0)
            results.append((time + shift, _ORDER[rest[0]], len(results), time, rest[0], rest[1:]))
    results.sort()
    for _, _, _, time, kind, rest in results:
        yield time, kind, rest


def judge(lines: Iterable[str], contract: Contract) -> dict[str, int]:
    """Compare a trace with the contract; return how often each event came."""
    events: dict[int, set[str]] = {}
    flags: list[tuple[int, frozenset[str]]] = []
    samples = []
    aborted = False
    for time, kind, rest in _records(lines):
        if contract.hung(time - 4):
            raise ContractBroken(f"{time}: hung in state {contract.state}")
        before = contract.waits_since if contract.state == "reset" else None
        if kind == "d":
            contract.edge(time)
        elif kind == "c":
            if contract.state == "startup":
                contract.start_begins(time)
            contract.begins(time)
            aborted = False
        elif kind == "f":
            contract.ends(time, int(rest[0], 16), int(rest[1], 16), aborted)
        elif kind == "x":
            contract.restart(time)
        elif kind == "e":
            contract.enable(time, rest[0] == "1")
        elif kind == "s":
            word = int(rest[0], 16)
            contract.settings = (word >> 32, word >> 16 & 0xFFFF, word & 0xFFFF)
        elif kind == "r":
            if rest[0] == "1":
                contract.reset_ends(time)
        elif kind == "E":
            events[time] = _names(rest[0], EVENTS)
            if "no_data_ready" in events[time]:
                contract.overdue(time)
        elif kind == "F":
            flags.append((time, frozenset(_names(rest[0], tuple(FLAG_MEANINGS)))))
        elif kind == "S":
            samples.append(
                (time, int(rest[0]), int(rest[1]), tuple(int(word, 16) for word in rest[2:]))
            )
        if contract.state == "reset" and contract.waits_since != before:
            aborted = True
    end = min(max(events, default=0), max(contract.events, default=0))
    _same(
        "events",
        {t: n for t, n in events.items() if t <= end},
        {t: n for t, n in contract.events.items() if t <= end},
    )
    _same(
        "flags",
        dict(f for f in flags if f[0] <= end),
        dict(f for f in contract.flags if f[0] <= end),
    )
    _same(
        "samples",
        {s[0]: s for s in samples if s[0] < end - 40},
        {s[0]: s for s in contract.samples if s[0] < end - 40},
    )
    return dict(Counter(name for names in events.values() for name in names))


def _same(what: str, got: dict[int, object], wanted: dict[int, object]) -> None:
    for time in sorted(got.keys() | wanted.keys()):
        if got.get(time) != wanted.get(time):
            raise ContractBroken(f"{time}: {what}: {got.get(time)}, wanted {wanted.get(time)}")


def _names(digits: str, names: tuple[str, ...]) -> set[str]:
    word = int(digits, 16)
    return {name for k, name in enumerate(names) if word >> k & 1}


def main() -> None:
    """Print a table of a run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    result = fuzz(arguments.frames, seed=arguments.seed)
    print(
        f"{result.frames} frames, {result.cycles} cycles, {result.edges} data-ready edges, "
        f"{result.cycles_per_s / 1e6:.1f} million cycles/s"
    )
    for name in EVENTS:
        print(f"  {name:16} {result.events.get(name, 0):8}")


if __name__ == "__main__":
    main()
