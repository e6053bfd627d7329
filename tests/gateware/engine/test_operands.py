"""The operand memories against a dictionary."""

import random

import pytest

from boresight.gateware.engine.operands import Operands
from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.image import Image
from boresight.gateware.schedule.links import Window


def physical(machine: Machine, address: int, parity: int) -> int:
    """Register address with bit c of the state region XORed with the parity."""
    half = machine.bank_depth // 2
    return address ^ (half // 2 if address & half and parity else 0)


def read_of(machine: Machine, address: int, parity: int, window: Window | None, others: int) -> int:
    """As `physical`; a state of the window goes by the parity of its owner."""
    slots = machine.bank_depth // 4
    owner = None if window is None else window.owner(address % slots, slots)
    if owner is not None:
        parity = others >> window.owners.index(owner) & 1
    return physical(machine, address, parity)


WINDOWS = [None, Window(4, (2,)), Window(16, (0, 1, 3, 2)), Window(2, (1, 0))]
CASES = [(config, w) for config in sorted(CONFIGS) for w in WINDOWS]
CASES += [("small-1024", Window(16, (0, 1, 3, 2))), ("fast-1024", Window(128, (1, 0)))]
CASES += [("small-2048", Window(256, (1, 0))), ("fast-2048", None)]


@pytest.mark.parametrize(("config", "window"), CASES)
def test_random_traffic(config: str, window: Window | None, simulate) -> None:
    machine = ALL_CONFIGS[config]
    rng = random.Random(3)
    lanes, depth = machine.lanes, machine.bank_depth
    registers = [rng.getrandbits(32) for _ in range(machine.register_words)]
    tables = [rng.getrandbits(32) for _ in range(1536)]
    image = Image(rom=[], registers=registers, tables=tables, lengths=(3,), window=window)
    dut = Operands(machine=machine, image=image)
    memory = list(registers)

    async def bench(ctx):
        expected: list[tuple[int, int] | None] = [None] * lanes
        for _ in range(900):
            parity, others = rng.getrandbits(1), 0
            if window is not None:
                others = rng.getrandbits(len(window.owners))
                ctx.set(dut.others, others)
            running = rng.random() < 0.8
            ctx.set(dut.parity, parity)
            ctx.set(dut.en, running)
            for k in range(lanes):
                a, b = rng.randrange(len(registers)), rng.randrange(len(registers))
                index = rng.randrange(128)
                table = rng.random() < 0.4
                if table:
                    b = rng.randrange(machine.TABLE_BLOCKS) << 2 | b & 3
                ctx.set(dut.a_addr[k], a)
                ctx.set(dut.b_addr[k], b)
                ctx.set(dut.table[k], table)
                ctx.set(dut.index[k], index)
                if running:
                    expected[k] = (
                        memory[read_of(machine, a, parity, window, others)],
                        tables[512 * (b >> 2) + 4 * index + (b & 3)]
                        if table
                        else memory[read_of(machine, b, parity, window, others)],
                    )
            # Written at the end of the cycle, but never what is being read: nothing relies on it.
            reads = {
                read_of(machine, ctx.get(port[k]), parity, window, others)
                for port in (dut.a_addr, dut.b_addr)
                for k in range(lanes)
            }
            for k in range(lanes):
                offset, word = rng.randrange(depth), rng.getrandbits(32)
                target = physical(machine, k * depth + offset, parity)
                write = rng.random() < 0.5 and target not in reads
                ctx.set(dut.w_en[k], write)
                ctx.set(dut.w_addr[k], offset)
                ctx.set(dut.w_data[k], word)
                if write:
                    memory[target] = word
            await ctx.tick()
            for k in range(lanes):
                if expected[k] is not None:
                    assert (ctx.get(dut.a[k]), ctx.get(dut.b[k])) == expected[k]

    simulate(dut, bench)
