"""The proof of microcode accepts what the compiler makes and refuses what computes other words."""

import functools
import random
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.gateware.machine import ALL_CONFIGS, MACHINES, Machine
from boresight.gateware.microcode.image import Image, Refuted, assemble, decode, encode
from boresight.gateware.microcode.validation import Emulator, validate_microcode
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.words.fixed import leading_sign_count, saturate, wrap
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Condition, Kind, Program, Scale
from tests.support.random_program import random_inputs, random_program, random_programs

CONFIG = pytest.mark.parametrize("config", ALL_CONFIGS)


def prove(core: Core, image: Image) -> None:
    programs = [part.program for part in core.parts]
    registers = [part.allocation.addresses for part in core.parts]
    validate_microcode(core.machine, image, programs, registers)


@CONFIG
@pytest.mark.parametrize("seed", range(3))
def test_random_programs(config: str, seed: int) -> None:
    """What is built is proven; `tests.conformance.test_estimators` builds the shipped programs."""
    build_shared_core(random_programs(seed, 1 + seed, n_ops=25), config)


def test_first_words() -> None:
    """Of parameters and of both copies of the states."""
    core = build_core(random_program(2, n_ops=10, n_states=3), "small")
    where, slots = core.allocation.addresses, core.machine.state_slots
    params = [where[n] for n in core.program.of_kind(Kind.PARAM)]
    states = [where[n] + copy for n, _ in core.program.states for copy in (0, slots)]
    assert params and states
    for register in (*params, *states):
        words = list(core.image.registers)
        words[register] ^= 1
        with pytest.raises(Refuted, match=rf" must begin with .* in register {register}$"):
            prove(core, replace(core.image, registers=words))


def test_words_of_other_programs() -> None:
    """A program or a restart that writes what another program needs later is refused."""
    core = build_shared_core(random_programs(1, 3, n_states=2), "small")
    machine, image = core.machine, core.image
    for number, base in enumerate(image.bases):
        at = base + (machine.stages.write + 3 if number < len(core.parts) else 1)
        for k, part in enumerate(core.parts):
            addresses = part.allocation.addresses
            for address in (
                addresses[state] for state, _ in part.program.states if k != number % 3
            ):
                for offset in (0, machine.state_slots):
                    fields = decode(machine, image.rom[at])
                    fields |= {"we0": 1, "dest0": address + offset, "get": 0}
                    rom = list(image.rom)
                    rom[at] = encode(machine, fields)
                    with pytest.raises(Refuted):
                        prove(core, replace(image, rom=rom))


@pytest.mark.parametrize("count", [1, 2])
def test_message(count: int, monkeypatch) -> None:
    """No core is built if its last program is wrong; the word that differs is named."""
    programs = random_programs(3, count, n_ops=12)
    core = build_shared_core(programs, "small")
    fields = [decode(core.machine, word) for word in core.image.rom]
    last = range(core.image.bases[count - 1], len(fields))
    k = next(k for k in last if fields[k]["shift0"] and fields[k]["when0"])
    fields[k]["shift0"] -= 1
    rom = [encode(core.machine, f) for f in fields]
    wrong = replace(core.image, rom=rom)
    monkeypatch.setattr("boresight.gateware.core.Image.join", lambda *_, **__: wrong)
    with pytest.raises(Refuted, match=r"^\w+: (output|next) \S+ must be .*, not .*"):
        build_shared_core(programs, "small")


# Seeded faults: one place of an image, of the registers, of the schedule, or of the skew.

Fault = Callable[[Program, Core, random.Random], Image]


def flipped(words: Sequence[int], bits: int, used: Sequence[int], rng: random.Random) -> list[int]:
    out = list(words)
    out[rng.choice(used)] ^= 1 << rng.randrange(bits)
    return out


def in_rom(program: Program, core: Core, rng: random.Random) -> Image:
    used = range(len(core.image.rom))
    return replace(core.image, rom=flipped(core.image.rom, core.machine.word_bits, used, rng))


def in_registers(program: Program, core: Core, rng: random.Random) -> Image:
    used = sorted(set(core.allocation.addresses.values()))
    return replace(core.image, registers=flipped(core.image.registers, 32, used, rng))


def in_tables(program: Program, core: Core, rng: random.Random) -> Image:
    """A bit of one coefficient, in every segment."""
    first, bit = rng.randrange(4), 1 << rng.randrange(32)
    tables = [word ^ bit * (k % 4 == first) for k, word in enumerate(core.image.tables)]
    return replace(core.image, tables=tables)


def in_allocation(program: Program, core: Core, rng: random.Random) -> Image:
    """Two values exchange their registers, or share one."""
    addresses = dict(core.allocation.addresses)
    a, b = rng.sample(sorted(addresses), 2)
    first, addresses[a] = addresses[a], addresses[b]
    if rng.random() < 0.5:
        addresses[b] = first
    return assemble(core.schedule, replace(core.allocation, addresses=addresses))


def in_schedule(program: Program, core: Core, rng: random.Random) -> Image:
    """A slot is a cycle early or late, loses a capture, its first or last, or its exchange."""
    slots = list(core.schedule.slots)
    k = rng.randrange(len(slots))
    slot = slots[k]
    changes = [{"cycle": slot.cycle - 1}, {"cycle": slot.cycle + 1}, {"swap": not slot.swap}]
    changes += [
        {name: not getattr(slot, name)}
        for name in ("cap_index", "cap_flag", "cap_norm", "quarter", "first", "last")
    ]
    slots[k] = replace(slot, **rng.choice(changes))
    return assemble(replace(core.schedule, slots=tuple(slots)), core.allocation)


def in_skew(program: Program, core: Core, rng: random.Random) -> Image:
    """A field stands a word early or late, everywhere."""
    fields = [decode(core.machine, word) for word in core.image.rom]
    name = rng.choice([f.name for f in core.machine.fields if f.name != "home"])
    column = [f[name] for f in fields]
    by = rng.choice((-1, 1))
    for f, value in zip(fields, column[by:] + column[:by], strict=True):
        f[name] = value
    return replace(core.image, rom=[encode(core.machine, f) for f in fields])


FAULTS = (in_rom, in_registers, in_tables, in_allocation, in_schedule, in_skew)


class Integers:
    """Words of the emulator that are integers in place of terms."""

    def __init__(self, machine: Machine, image: Image) -> None:
        self.arith = machine.arithmetic
        self.tables = [self.signed(word) for word in image.tables]
        self.overflows = False

    def signed(self, word: int) -> int:
        return wrap(word, self.arith.word)

    def symbol(self, name: str, number: int = 0) -> int:
        return 0

    def fraction(self, word: int) -> int:
        return word & ((1 << self.arith.fraction_bits) - 1)

    def sign(self, word: int, *, quarter: bool) -> int:
        return self.signed(word + (quarter << self.arith.word - 2)) < 0

    def index(self, word: int, *, quarter: bool) -> int:
        word = self.signed(word + (quarter << self.arith.word - 2))
        return word >> self.arith.fraction_bits & (1 << self.arith.INDEX_BITS) - 1

    def count(self, word: int) -> int:
        return int(leading_sign_count(word, self.arith))

    def coefficient(self, block: int, coefficient: int, index: int) -> int:
        return self.tables[block * Machine.TABLE_BLOCK + 4 * index + coefficient]

    def product(self, a: int, b: int) -> int:
        return a * b

    def amount(self, shift: int, scale: Scale, count: int) -> int:
        part = {Scale.NONE: 0, Scale.FULL: count, Scale.EVEN: count & ~1, Scale.HALF: count >> 1}
        return max(0, shift - part[scale])

    def shifted(self, product: int, amount: int) -> int:
        return product >> amount

    def total(self, total: int | None, shifted: int, negate: Condition, take: Condition) -> int:
        sign, part = (bit ^ bool(flag) for bit, flag in (negate, take))
        start = 1 << self.arith.guard - 1 if total is None else total
        return wrap(start + part * (-shifted if sign else shifted), self.arith.acc_width)

    def result(self, total: int, *, wrap: bool) -> int:
        q = total >> self.arith.guard
        word = self.signed(q) if wrap else int(saturate(q, self.arith.word))
        self.overflows = word != q
        return word

    def may_overflow(self, word: int) -> bool:
        return self.overflows


def computes(core: Core, image: Image, records: list[list[int]]) -> bool:
    """Whether the emulator's words are the interpreter's over some updates."""
    domain = Integers(core.machine, image)
    emulator, model = Emulator(core.machine, image, domain), Interpreter(core.program)
    emulator.registers = [domain.signed(word) for word in image.registers]
    for record in records:
        out, saturated = model.update([[word] for word in record])
        emulator.flagged.clear()
        update = emulator.update(record)
        if update.outputs != out[:, 0].tolist() or bool(emulator.flagged) != saturated[0]:
            return False
        for lasts, words in ((update.gets, record), (update.emits, core.program.outputs)):
            if lasts != [False] * (len(words) - 1) + [True]:
                return False
    return True


def refuted(core: Core, image: Image) -> bool:
    try:
        prove(core, image)
    except Refuted:
        return True
    return False


@functools.cache
def random_core(seed: int) -> Core:
    program = random_program(seed, n_ops=20, n_states=1 + seed % 4)
    return build_core(program, random.Random(seed).choice(list(MACHINES)))


def seeded(fault: Fault, seed: int) -> tuple[Core, Image, bool] | None:
    """A core, its image with a fault, and whether some input shows it; None: the assembler did."""
    core = random_core(seed)
    try:
        image = fault(core.program, core, random.Random(f"{fault.__name__} {seed}"))
        image.check(core.machine)
        return core, image, not computes(core, image, random_inputs(core.program, seed, 12))
    except (ScheduleError, ValueError, IndexError):
        return None  # or it leaves the program


@pytest.mark.parametrize("fault", FAULTS)
def test_faults(fault: Fault, seeds: int = 40) -> None:
    """Each fault that some input shows is refuted; the others change nothing that is read."""
    shown = 0
    for seed in range(4 * seeds):
        if seed >= seeds and shown >= seeds // 8:
            break
        if (found := seeded(fault, seed)) is not None and found[2]:
            shown += 1
            assert refuted(*found[:2]), seed
    assert shown >= seeds // 8


def test_exchanged_states() -> None:
    """The registers of parameters and states are those that the microcode reads and writes."""
    program = random_program(5, n_ops=10, n_states=3)
    core = build_core(program, "small")
    registers = core.allocation.addresses
    states = [state for state, _ in program.states]
    registers[states[0]], registers[states[1]] = registers[states[1]], registers[states[0]]
    with pytest.raises(Refuted):
        validate_microcode(core.machine, core.image, [program], [registers])
