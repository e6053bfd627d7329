"""Several programs in one core: what they share, what they must not, each runs as if alone."""

import dataclasses

import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, MACHINES
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value
from tests.support.random_program import random_program, random_programs

CONFIG = pytest.mark.parametrize("config", sorted(CONFIGS))


def shared(config: str, seed: int, count: int = 3, **options) -> Core:
    return build_shared_core(random_programs(seed, count, **options), config)


def test_digest_is_of_all_programs_in_order() -> None:
    a, b = random_programs(4, 2)
    both, other = build_shared_core([a, b], "small"), build_shared_core([b, a], "small")
    assert both.digest != other.digest and both.image.digest == int(both.digest, 16)
    assert build_core(a, "small").digest == a.digest


def wide(name: str, n: int) -> Program:
    """A sum of the input times each of n parameters."""
    values = [Value("x", Kind.INPUT, 31, -1, 1, "test")]
    values += [Value(f"p{k}", Kind.PARAM, 31, -1, 1, "test", initial=1 << k % 30) for k in range(n)]
    values.append(Value("y", Kind.OP, 31, -1, 1, "test"))
    op = Op(n + 1, tuple(Term(0, k + 1, 23) for k in range(n)))
    return Program(name, Arithmetic(), tuple(values), (op,), (0,), (n + 1,), ("y",), (), ())


@pytest.mark.parametrize(
    ("config", "needed", "there", "end"),
    [
        ("small", 512, 256, "config small-1024 has more"),
        ("small-1024", 768, 512, "the bus has no more addresses"),
        ("small-2048", 768, 512, "the bus has no more addresses"),
        ("fast-2048", 320, 256, "the bus has no more addresses"),
    ],
)
def test_parameters_beyond_registers_or_addresses(
    config: str, needed: int, there: int, end: str
) -> None:
    """All parameters of the programs up to the first that has no room."""
    several = [wide(name, 256) for name in "abc"]
    wanted = rf"^[abc]: parameters need {needed} registers .* has {there} for them; {end}$"
    with pytest.raises(ScheduleError, match=wanted):
        build_shared_core(several, config)


@pytest.mark.parametrize("config", sorted(ALL_CONFIGS))
def test_many_parameters(config: str) -> None:
    """So many that with two lanes they fill more than one bank's share."""
    more = 160 if ALL_CONFIGS[config].register_words == 2048 else 70
    programs = [wide("a", 40), wide("b", more)]
    core = build_shared_core(programs, config)
    machine = core.machine
    addresses = [list(core.select(k).parameter_addresses.values()) for k in range(2)]
    registers = [machine.parameter_register(k) for k in range(40 + more)]
    assert addresses[0] + addresses[1] == [machine.parameter_address(r) for r in registers]
    assert max(addresses[1]) < 512 and machine.lanes == len(
        {r // machine.bank_depth for r in registers}
    )


def test_refused() -> None:
    a, b = random_programs(4, 2)
    with pytest.raises(
        ValueError,
        match=r"^programs must have different names, not \['random0', "
        r"'random0'\]$",
    ):
        build_shared_core([a, a], "small")
    tables = dataclasses.replace(b, table_memory=(1, *b.table_memory[1:]))
    with pytest.raises(
        ScheduleError,
        match=r"^random0, random1: function tables of the programs "
        r"must be the same$",
    ):
        build_shared_core([a, tables], "small")
    crowd = random_programs(5, 3, n_states=43)
    with pytest.raises(
        ScheduleError,
        match=r"^random0 43, random1 43, random2 43: 129 states, the fast "
        r"machine has room for 128; config fast-1024 has more$",
    ):
        build_shared_core(crowd, "fast")


def test_too_long_together(monkeypatch) -> None:
    programs = random_programs(4, 2)
    lengths = [len(build_core(p, "small").image.rom) for p in programs]
    machine = dataclasses.replace(CONFIGS["small"], rom_words=sum(lengths) - 1)
    monkeypatch.setitem(MACHINES, "small", machine)
    with pytest.raises(
        ScheduleError,
        match=rf"^the programs take {sum(lengths)} microwords, the "
        rf"small machine has {sum(lengths) - 1}: random0 {lengths[0]}, random1 {lengths[1]}$",
    ):
        build_shared_core(programs, "small")


def test_a_schedule_is_kept_for_what_it_was_made_for() -> None:
    program = random_program(8, n_ops=20)
    again = dataclasses.replace(program)
    first = build_core(program, "small").schedule
    assert build_core(again, "small").schedule is first
    assert build_core(program, "fast").schedule.machine.name == "fast"
    urgent = dataclasses.replace(program, urgent=1)
    assert build_core(urgent, "small").schedule.urgent == 1
    for low in (0.0, -0.0):  # equal, but other programs
        value = dataclasses.replace(program.values[0], low=low)
        other = dataclasses.replace(program, values=(value, *program.values[1:]))
        assert build_core(other, "small").schedule.source == other.digest
