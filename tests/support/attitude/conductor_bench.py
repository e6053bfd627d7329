"""The attitude core in compiled simulation, played to by a script.

The bench (``conductor_bench.sv``) takes one command a cycle::

    w N                  wait N cycles
    s STAMP W0 .. W5     a sample (hexadecimal)
    l C V0 V1 V2         a line of the compass, C 1: counts (values hexadecimal)
    f N, o N, u N, r, i  filter, source, run, restart, initial states
    b ADDRESS WORD       write on the bus, until it is acknowledged (word hexadecimal)
    d ADDRESS            read on the bus
    e K WORD, k          input register K (word hexadecimal); take the set
    n N                  wait for N updates in all
    t, q                 second reader: take, print its words
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.core import Core
from boresight.gateware.synthesis.tools import to_verilog
from boresight.model.words.fixed import IntArray, wrap
from boresight.sim.attitude.board.chain import COUNTS, NO_LINE, Samples
from boresight.sim.rtl.simulation import split_memories
from boresight.sim.rtl.simulators import build


@dataclass
class Played:
    """What the core did.

    Attributes
    ----------
    sampled, updated : list of int
        Cycles.
    results : list of list of int
        Signed words of the result memory after each update, as the first reader took them.
    taken : list of list of int
        The same of the second reader, for each command ``q``.
    events : list of (cycle, name)
        All but the updates.
    reads : list of (address, word)
        Unsigned words that the bus has read.
    """

    sampled: list[int] = field(default_factory=list)
    updated: list[int] = field(default_factory=list)
    results: list[list[int]] = field(default_factory=list)
    taken: list[list[int]] = field(default_factory=list)
    events: list[tuple[int, str]] = field(default_factory=list)
    reads: list[tuple[int, int]] = field(default_factory=list)

    def named(self, name: str) -> list[int]:
        """Cycles of the events of one name."""
        return [cycle for cycle, n in self.events if n == name]

    def words(self, first: int, count: int) -> IntArray:
        """``count`` result words from place ``first`` on, of every update: (n, count)."""
        return np.array([words[first : first + count] for words in self.results], dtype=np.int64)


def play(core: Core, script: Iterable[str], *, max_cycles: int = 20_000_000) -> Played:
    """Run a script.

    Raises
    ------
    SimulationFailed
        It did not end in time.
    """
    top, text, memories = _made(core)
    word = core.machine.arithmetic.word
    bench = Path(__file__).with_name("conductor_bench.sv").read_text()
    if top.plan.feed.registers:
        bench = f"`define FEED\n{bench}"
    run = build(
        "bench",
        {"attitude_core.sv": text, "bench.sv": bench},
        parameters={"WORD": word, "FILTER_BITS": len(top.filter)},
    ).run(
        max_cycles=max_cycles, files={**memories, "script.txt": "".join(f"{s}\n" for s in script)}
    )
    return _parse(run.stdout, word)


#: What was made of a core, by its identity; the core is kept, so that nothing else gets it.
_MADE: dict[int, tuple[Core, Conductor, str, dict[str, str]]] = {}


def _made(core: Core) -> tuple[Conductor, str, dict[str, str]]:
    """The core with its conductor, its Verilog and the contents of its memories."""
    if id(core) not in _MADE:
        top = Conductor(core=core)
        verilog = to_verilog(top, "attitude_core", instances=False)
        _MADE[id(core)] = (core, top, *split_memories(verilog))
    return _MADE[id(core)][1:]


def _parse(text: str, word: int) -> Played:
    out = Played()
    dumps = {"D": out.results, "Q": out.taken}
    for line in text.splitlines():
        kind, *fields = line.split()
        if kind == "S":
            out.sampled.append(int(fields[0]))
        elif kind == "U":
            out.updated.append(int(fields[0]))
        elif kind == "E":
            out.events += [
                (int(fields[0]), name)
                for k, name in enumerate(Conductor.EVENTS)
                if k and int(fields[1]) >> k & 1
            ]
        elif kind == "R":
            out.reads.append((int(fields[0]), int(fields[1], 16)))
        elif kind in dumps:
            if fields[0] == "0":
                dumps[kind].append([])
            dumps[kind][-1].append(wrap(int(fields[1], 16), word))
        elif kind not in ("-", "*"):
            raise ValueError(f"the bench says {line!r}")
    return out


def sample_command(stamp: int, counts: Sequence[int]) -> str:
    """A sample as a command."""
    return f"s {int(stamp) & 0xFFFFFFFF:x} " + " ".join(f"{int(c) & 0xFFFF:x}" for c in counts)


def script_of(
    samples: Samples, *, start: Sequence[str] = ("o 3", "u 1"), pause: int = 80
) -> list[str]:
    """Samples one after another, each when the one before is done with, its line before it.

    The line of an update is sent while the one before is worked at, so that its field is fresh
    then; that of the first is left out.
    """
    out = [*start, f"f {samples.filter[0]}", "w 10"]
    for k in range(len(samples)):
        if k and samples.filter[k] != samples.filter[k - 1]:
            out.append(f"f {samples.filter[k]}")
        if k and samples.restart[k]:
            out.append("r")
        out.append(sample_command(samples.stamp[k], samples.counts[k]))
        if k + 1 < len(samples) and samples.line[k + 1] != NO_LINE:
            out.append(
                f"l {int(samples.line[k + 1] == COUNTS)} "
                + " ".join(f"{int(v) & 0xFFFF:x}" for v in samples.values[k + 1])
            )
        out += [f"n {k + 1}", f"w {pause + 100 * int(k + 1 < len(samples))}"]
    return out
