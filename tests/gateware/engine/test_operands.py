"""The operand memories against a dictionary."""

import random
from typing import Any

import pytest
from amaranth.hdl import Module

from boresight.gateware.engine.operands import Operands
from boresight.gateware.machine import ALL_CONFIGS, Machine
from boresight.gateware.microcode.image import Image
from tests.support.bench import Pins, run_bench


def physical(machine: Machine, address: int, parity: int) -> int:
    """Register address with bit c of the state region XORed with the parity."""
    half = machine.bank_depth // 2
    return address ^ (half // 2 if address & half and parity else 0)


@pytest.mark.parametrize("config", ["small", "fast", "small-1024", "fast-2048"])
def test_random_traffic(config: str) -> None:
    machine = ALL_CONFIGS[config]
    rng = random.Random(3)
    lanes, depth = machine.lanes, machine.bank_depth
    registers = [rng.getrandbits(32) for _ in range(machine.register_words)]
    tables = [rng.getrandbits(32) for _ in range(1536)]
    image = Image(rom=[], registers=registers, tables=tables, lengths=(3,))
    top, dut = Module(), Operands(machine=machine, image=image)
    top.submodules.dut = dut
    memory = list(registers)
    of_lanes = ("a_addr", "b_addr", "table", "index", "w_en", "w_addr", "w_data")
    signals: dict[Any, Any] = {(n, k): getattr(dut, n)[k] for n in of_lanes for k in range(lanes)}
    signals |= {"parity": dut.parity, "en": dut.en}
    pins = Pins(top, signals, driven=True)

    async def bench(ctx):
        expected: list[tuple[int, int] | None] = [None] * lanes
        for _ in range(900):
            parity, reads = rng.getrandbits(1), set()
            running = rng.random() < 0.8
            values: dict[Any, int] = {"parity": parity, "en": running}
            for k in range(lanes):
                a, b = rng.randrange(len(registers)), rng.randrange(len(registers))
                index = rng.randrange(128)
                table = rng.random() < 0.4
                if table:
                    b = rng.randrange(machine.TABLE_BLOCKS) << 2 | b & 3
                values |= {("a_addr", k): a, ("b_addr", k): b, ("table", k): table}
                values["index", k] = index
                # Never written at the end of the cycle: nothing relies on what is then read.
                reads |= {physical(machine, at, parity) for at in (a, b)}
                if running:
                    expected[k] = (
                        memory[physical(machine, a, parity)],
                        tables[512 * (b >> 2) + 4 * index + (b & 3)]
                        if table
                        else memory[physical(machine, b, parity)],
                    )
            for k in range(lanes):
                offset, word = rng.randrange(depth), rng.getrandbits(32)
                target = physical(machine, k * depth + offset, parity)
                write = rng.random() < 0.5 and target not in reads
                values |= {("w_en", k): write, ("w_addr", k): offset, ("w_data", k): word}
                if write:
                    memory[target] = word
            pins.put(ctx, values)
            await ctx.tick()
            for k in range(lanes):
                if expected[k] is not None:
                    assert (ctx.get(dut.a[k]), ctx.get(dut.b[k])) == expected[k]

    run_bench(top, bench)
