"""The sequencer with random microcode and random streams, against its rules."""

import random
from dataclasses import dataclass

import pytest

from gateware.image import Image
from gateware.machine import CONFIGS
from gateware.microcode import encode
from gateware.sequencer import Sequencer

FIELDS = ("get", "get_last", "emit", "commit", "home", "we0", "we1")
OUTPUTS = ("active", "en", "write", "i_ready", "o_valid", "grant", "idle", "commit", "framing")


@dataclass
class Rules:
    """What `docs/engine.md` says, one cycle at a time."""

    program: list[dict[str, int]]
    lanes: int
    at: int = -1  #: word at work; -1: none yet
    begun: bool = False
    swallowing: bool = False

    def cycle(self, i_valid: int, i_last: int, o_ready: int, request: int) -> dict[str, int]:
        """Outputs of a cycle; moves on to the next."""
        word = self.program[self.at] if self.at >= 0 else dict.fromkeys(FIELDS, 0)
        first = word["get"] and not self.begun
        grant = first and request
        takes = word["get"] and i_valid and not self.swallowing and not grant
        moves = not (word["get"] and not takes) and not (word["emit"] and not o_ready)
        fault = takes and i_last != word["get_last"]
        write = 0
        for lane in range(self.lanes):
            if moves and word[f"we{lane}"]:
                write |= 1 << lane
        if takes or grant:
            write |= 1
        out = {"active": self.at >= 0, "en": moves, "write": write, "grant": grant,
               "i_ready": self.swallowing or (word["get"] and not grant),
               "o_valid": word["emit"], "idle": first and not i_valid,
               "commit": word["commit"] and moves and not fault, "framing": fault}
        if self.swallowing and i_valid and i_last:
            self.swallowing = False
        if takes:
            self.begun = not (i_last or word["get_last"])
            self.swallowing = bool(word["get_last"] and not i_last)
        if fault:
            self.at = -1
        elif moves:
            self.at = 0 if self.at >= 0 and word["home"] else self.at + 1
        return {name: int(value) for name, value in out.items()}


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("config", sorted(CONFIGS))
def test_random_programs(config: str, seed: int, simulate) -> None:
    rng = random.Random(seed)
    machine = CONFIGS[config]
    length = rng.randrange(2, 20)
    program = []
    for number in range(length):
        word = {name: rng.getrandbits(1) for name in FIELDS}
        word["get"] = int(number == 0 or rng.random() < 0.4)
        word["emit"] &= ~word["get"]
        word["get_last"] &= word["get"]
        word["home"] = int(number == length - 1)
        program.append(word)
    known = {f.name for f in machine.fields()}
    rom = [encode(machine, {k: v for k, v in word.items() if k in known}) for word in program]
    # Words behind the program are never at work: fill them with everything at once.
    rom += [(1 << machine.word_bits) - 1] * (machine.rom_words - length)
    dut = Sequencer(machine=machine, image=Image(rom=rom, registers=[0] * 512, tables=[0] * 1536,
                                                 length=length))
    rules = Rules(program, machine.lanes)

    async def bench(ctx):
        for cycle in range(1200):
            # Mostly the ``last`` that the program wants, so that updates also end.
            wanted = program[rules.at]["get_last"] if rules.at >= 0 else 0
            inputs = {"i_valid": int(rng.random() < 0.7),
                      "i_last": wanted if rng.random() < 0.9 else 1 - wanted,
                      "o_ready": int(rng.random() < 0.7), "request": int(rng.random() < 0.2)}
            for name, value in inputs.items():
                ctx.set(getattr(dut, name), value)
            got = {name: ctx.get(getattr(dut, name)) for name in OUTPUTS}
            at = rules.at
            want = rules.cycle(**inputs)
            assert got == want, (cycle, at, inputs)
            seen.update(name for name in OUTPUTS if want[name])
            await ctx.tick()

    seen: set[str] = set()
    simulate(dut, bench)
    assert seen >= set(OUTPUTS) - {"commit", "o_valid", "idle"}
