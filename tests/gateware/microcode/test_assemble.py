"""Microwords: skew, fields, errors."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble, decode, encode
from boresight.gateware.schedule.allocate import allocate
from boresight.gateware.schedule.search import ScheduleError, schedule
from tests.support.random_program import random_program

MACHINES = pytest.mark.parametrize("machine", ALL_CONFIGS.values(), ids=ALL_CONFIGS)


@MACHINES
def test_decode_inverts_encode(machine: Machine) -> None:
    fields = {
        f.name: (1 << f.width) - 1 if k % 3 else k % (1 << f.width)
        for k, f in enumerate(machine.fields())
    }
    assert decode(machine, encode(machine, fields)) == fields


@MACHINES
def test_fields_stand_in_the_word_of_their_stage(machine: Machine) -> None:
    for seed in range(8):
        p = random_program(seed)
        s = schedule(p, machine, restarts=0)
        a = allocate(s)
        where = a.addresses()
        image = assemble(s, a)
        words = [decode(machine, w) for w in image.rom]
        assert len(words) == s.length and image.lengths == (s.length,)
        for slot in s.slots:
            k = slot.lane
            assert words[slot.cycle][f"a_addr{k}"] == where[slot.a]
            assert words[slot.cycle + 1][f"cap_flag{k}"] == slot.cap_flag
            if slot.emit is not None:
                assert words[slot.cycle + 1]["emit"] == 1
                assert words[slot.cycle + 1]["emit_last"] == (slot.emit == len(p.outputs) - 1)
            if slot.op is None:
                continue
            op = s.program.ops[slot.op]
            assert words[slot.cycle + 5][f"first{k}"] == slot.first
            assert words[slot.cycle + 6][f"we{k}"] == slot.last
            if slot.last:
                assert words[slot.cycle + 6][f"dest{k}"] == where[op.dest] % machine.bank_depth
            if slot.term is not None:
                assert words[slot.cycle + 3][f"shift{k}"] == op.terms[slot.term].shift
        assert [c for c, w in enumerate(words) if w["get"]] == list(s.gets)
        assert [c for c, w in enumerate(words) if w["get_last"]] == [s.gets[-1]]
        assert [c for c, w in enumerate(words) if w["home"]] == [s.length - 1]


@MACHINES
def test_digest_is_the_programs(machine: Machine) -> None:
    p = random_program(1)
    s = schedule(p, machine, restarts=0)
    assert f"{assemble(s, allocate(s)).digest:064x}" == p.digest


def test_errors() -> None:
    machine = CONFIGS["small"]
    with pytest.raises(ValueError, match=r"^field shift0 must be 0 to 31, not 32$"):
        encode(machine, {"shift0": 32})
    with pytest.raises(ValueError, match=r"^fields must be those of the machine, not \['x'\]$"):
        encode(machine, {"x": 0})
    with pytest.raises(ValueError, match=r"^word must have \d+ bits, not more$"):
        decode(machine, 1 << machine.word_bits)
    s = schedule(random_program(1), machine, restarts=0)
    a = allocate(s)
    with pytest.raises(ScheduleError, match=r"falls behind the program's \d+ words$"):
        assemble(dataclasses.replace(s, length=s.length - 1), a)
    long = dataclasses.replace(s.program, table_memory=(0,) * 2048)
    with pytest.raises(ScheduleError, match=r"table memory must be 1536 words or fewer, not 2048"):
        assemble(dataclasses.replace(s, program=long), a)
