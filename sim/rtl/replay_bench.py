"""The bench of `harness.cpp` in Python under cocotb: slow, but it sees unknown values (X).

The files ``batch`` and ``results`` have the formats of `harness.cpp`; the file ``unknown`` names a
value that was unknown.
"""

from __future__ import annotations

import struct
from array import array
from pathlib import Path
from typing import Any

import cocotb
from cocotb.triggers import Timer

#: Cycles of reset.
_RESET = 4


class _Unknown(Exception):
    """A value has unknown bits."""


@cocotb.test()
async def replay(dut: Any) -> None:
    """Run a batch from the core's reset on."""
    bench = _Bench(dut, Path("batch").read_bytes())
    try:
        await bench.run()
    except _Unknown as unknown:
        Path("unknown").write_text(f"{unknown}, record {bench.update}, cycle {bench.cycle}")
    parts = (bench.updates, bench.words, bench.cycles, bench.traced)
    Path("results").write_bytes(b"".join(struct.pack("q", len(x)) + x.tobytes() for x in parts))


class _Bench:
    def __init__(self, dut: Any, batch: bytes) -> None:
        self.dut = dut
        self.bits, self.lanes = len(dut.bus_data), len(dut.w_en)
        count, writes, self.stall, self.trace, self.limit = struct.unpack_from("5q", batch)
        numbers = array("i", batch[40:]).tolist()
        lengths, words = numbers[:count], iter(numbers[count:])
        self.records = [[next(words) for _ in range(length)] for length in lengths]
        self.writes = [[next(words) for _ in range(3)] for _ in range(writes)]
        self.updates, self.words, self.cycles, self.traced = (array("i") for _ in range(4))
        self.update = self.cycle = 0

    async def half(self, clk: int, **inputs: int) -> None:
        """Half a cycle; the inputs change as it begins."""
        for name, value in (inputs | {"clk": clk}).items():
            getattr(self.dut, name).value = value
        await Timer(5, "ns")

    def read(self, name: str) -> int:
        value = getattr(self.dut, name).value
        if not value.is_resolvable:
            raise _Unknown(f"{name} = {value}")
        return int(value)

    def write_down(self) -> None:
        """Register writes of the lanes; one with unknown bits has address -1."""
        names = ("w_en", "w_addr", "w_data")
        enables, *values = (str(getattr(self.dut, name).value)[::-1] for name in names)
        for lane in range(self.lanes):
            parts = [
                text[width * lane : width * (lane + 1)][::-1]
                for text, width in zip(values, (10, self.bits), strict=True)
            ]
            if enables[lane] != "0":
                defined = set("".join(parts)) <= {"0", "1"}
                address, word = (int(part, 2) for part in parts) if defined else (-1, 0)
                self.traced.extend((lane, address, self.signed(word), self.cycle))

    def signed(self, word: int) -> int:
        sign = 1 << (self.bits - 1)
        return ((word & (2 * sign - 1)) ^ sign) - sign

    async def run(self) -> None:
        """Cycle for cycle as `Harness::run`."""
        last, stall = 1 << self.bits, self.stall
        idle = {"in_valid": 0, "in_payload": 0, "out_ready": 0}
        await self.half(0, rst=1, bus_stb=0, bus_addr=0, bus_data=0, restart=0, **idle)
        for _ in range(_RESET):
            await self.half(1)
            await self.half(0)
        self.dut.rst.value = 0
        lfsr = (0x2F6E2B1 + stall) & 0xFFFF_FFFF
        record = index = 0
        offer, counting, complete = True, False, False
        first = 0
        while True:
            write_pending = index == 0 and bool(self.writes) and self.writes[0][0] == record
            valid = offer and record < len(self.records) and not write_pending
            strobe, take = write_pending and not counting, not stall or (lfsr >> 3 ^ lfsr >> 17) & 1
            is_last = valid and index == len(self.records[record]) - 1
            inputs = {"in_valid": valid, "out_ready": take, "bus_stb": strobe}
            if valid:
                inputs["in_payload"] = self.records[record][index] & (last - 1) | is_last * last
            if strobe:
                _, inputs["bus_addr"], word = self.writes[0]
                inputs["bus_data"] = word & (last - 1)
            await self.half(0, **inputs)
            if counting and self.update == self.trace:
                self.write_down()
            ready, taken = self.read("in_ready"), self.read("out_valid") and take
            begins = ready and index == 0 and counting and complete and record == self.update + 1
            if begins or not self.limit:
                count, interval = len(self.words) - first, self.cycle if begins else -1
                self.updates.extend((count, self.read("flags"), interval))
                self.update, first, complete = self.update + 1, len(self.words), False
            if self.update == len(self.records) or not self.limit:
                return
            self.limit -= 1
            if taken:
                payload = self.read("out_payload")
                self.words.append(self.signed(payload))
                self.cycles.append(self.cycle)
                complete = payload >= last
            if strobe and self.read("bus_ack"):
                del self.writes[0]
            await self.half(1)
            self.cycle += 1
            counting = counting and not begins
            if valid and ready:
                if index == 0:
                    self.cycle, counting = 1, True
                index, record = (0, record + 1) if is_last else (index + 1, record)
                offer = not stall or bool(lfsr >> 5 & 1)
            elif not offer:
                offer = bool(lfsr >> 9 & 1)
            bit = (lfsr >> 31 ^ lfsr >> 21 ^ lfsr >> 1 ^ lfsr) & 1
            lfsr = (lfsr << 1 | bit) & 0xFFFF_FFFF
