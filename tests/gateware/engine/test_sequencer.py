"""The sequencer with random microcode and random streams, against its rules."""

import random
from dataclasses import dataclass

import pytest
from amaranth.hdl import Module

from boresight.gateware.engine.sequencer import Sequencer
from boresight.gateware.machine import ALL_CONFIGS, CONFIGS
from boresight.gateware.microcode.assemble import encode
from boresight.gateware.microcode.image import Image
from tests.support.bench import Pins, run_bench

FIELDS = ("get", "get_last", "emit", "home", "we0", "we1")
INPUTS = ("program", "i_valid", "i_last", "o_ready", "request", "switch")
OUTPUTS = (
    "active",
    "en",
    "write",
    "i_ready",
    "o_valid",
    "grant",
    "start",
    "idle",
    "commit",
    "framing",
)
#: Cycles without a word at work after a reset, a fault or a change of program.
FILL = 3


@dataclass
class Rules:
    """What `docs/engine.md` says, one cycle at a time."""

    programs: list[list[dict[str, int]]]
    lanes: int
    program: int = 0
    at: int = -FILL  #: word at work; negative: cycles until there is one
    begun: bool = False
    swallowing: bool = False

    @property
    def word(self) -> dict[str, int]:
        """Word at work."""
        return self.programs[self.program][self.at] if self.at >= 0 else dict.fromkeys(FIELDS, 0)

    def cycle(
        self, i_valid: int, i_last: int, o_ready: int, request: int, switch: int, other: int
    ) -> dict[str, int]:
        """Outputs of a cycle; moves on to the next, on a switch to the ``other`` program."""
        word = self.word
        first = word["get"] and not self.begun
        grant = first and request
        takes = word["get"] and i_valid and not self.swallowing and not grant
        moves = not (word["get"] and not takes) and not (word["emit"] and not o_ready)
        fault = takes and i_last != word["get_last"]
        write = 0
        for lane in range(self.lanes):
            if moves and word[f"we{lane}"]:
                write |= 1 << lane
        if takes or grant and not switch:
            write |= 1
        out = {
            "active": self.at >= 0,
            "en": moves,
            "write": write,
            "grant": grant,
            "start": self.at == -FILL,
            "i_ready": self.swallowing or (word["get"] and not grant),
            "o_valid": word["emit"],
            "idle": first and not i_valid,
            "commit": word["home"] and moves and not fault,
            "framing": fault,
        }
        if self.swallowing and i_valid and i_last:
            self.swallowing = False
        if takes:
            self.begun = not (i_last or word["get_last"])
            self.swallowing = bool(word["get_last"] and not i_last)
        if fault or grant and switch:
            self.at = -FILL
            self.program = other if grant else self.program
        elif moves:
            self.at = 0 if self.at >= 0 and word["home"] else self.at + 1
        return {name: int(value) for name, value in out.items()}


def random_words(rng: random.Random, length: int) -> list[dict[str, int]]:
    """A program that gets its first word at once."""
    words = []
    for number in range(length):
        word = {name: rng.getrandbits(1) for name in FIELDS}
        word["get"] = int(number == 0 or rng.random() < (0.4 if length < 20 else 0.02))
        word["emit"] &= ~word["get"]
        word["get_last"] &= word["get"]
        word["home"] = int(number == length - 1)
        words.append(word)
    return words


CASES = [(c, seed, count) for c in sorted(CONFIGS) for seed in range(3) for count in (1, 2, 3)]
MORE = [(c, seed, count) for c in sorted(CONFIGS) for seed in range(3, 20) for count in (1, 2, 3)]
SOAK = [pytest.param(*case, marks=pytest.mark.soak) for case in MORE]


@pytest.mark.parametrize(("config", "seed", "count"), [*CASES, ("small-1024", 0, 3), *SOAK])
def test_random_programs(config: str, seed: int, count: int) -> None:
    rng = random.Random(seed)
    machine = ALL_CONFIGS[config]
    lengths = [rng.randrange(3, 20) for _ in range(count)]
    # A long program in between, so that the ROM has several memories. The machine waits at a
    # program's first word, while the counter is two words ahead: also across memories.
    if count == 3:
        lengths[0], lengths[1] = 1022 + seed, 600 if config in CONFIGS else 1100
    programs = [random_words(rng, length) for length in lengths]
    known = {f.name for f in machine.fields}
    rom = [
        encode(
            machine, {"shift0": rng.randrange(32), **{k: v for k, v in word.items() if k in known}}
        )
        for words in programs
        for word in words
    ]
    # Words behind the programs are never at work: fill them with everything at once.
    rom += [(1 << machine.word_bits) - 1] * 5
    image = Image(
        rom=rom, registers=[0] * machine.register_words, tables=[0] * 1536, lengths=tuple(lengths)
    )
    top, dut = Module(), Sequencer(machine=machine, image=image)
    top.submodules.dut = dut
    driven = Pins(top, {name: getattr(dut, name) for name in INPUTS}, driven=True)
    shown = Pins(top, {name: getattr(dut, name) for name in (*OUTPUTS, "word")})
    rules = Rules(programs, machine.lanes)
    home = encode(machine, {"home": 1})

    async def bench(ctx):
        for cycle in range(2400 if count == 3 else 1200):
            # Mostly the ``last`` that the program wants, so that updates also end.
            wanted = rules.word["get_last"]
            request = int(rng.random() < (0.5 if count == 3 else 0.2))
            inputs = {
                "i_valid": int(rng.random() < 0.7),
                "i_last": wanted if rng.random() < (0.9 if count < 3 else 0.98) else 1 - wanted,
                "o_ready": int(rng.random() < 0.7),
                "request": request,
                "switch": int(count > 1 and rng.random() < 0.5),
            }
            driven.put(ctx, {"program": rules.program, **inputs})
            got = shown.get(ctx)
            word, at, program = got.pop("word"), rules.at, rules.program
            if at >= 0:
                assert (word ^ image.program(program)[at]) & ~home == 0, (cycle, program, at)
            other = rng.choice([n for n in range(count) if n not in ran] or range(count))
            want = rules.cycle(**inputs, other=other)
            assert got == want, (cycle, program, at, inputs)
            seen.update(name for name in OUTPUTS if want[name])
            ran.add(rules.program)
            await ctx.tick()

    seen: set[str] = set()
    ran: set[int] = set()
    run_bench(top, bench)
    rare = {"framing", "write"} if count == 3 else set()
    assert seen >= set(OUTPUTS) - {"commit", "o_valid", "idle"} - rare
    assert ran == set(range(count))
