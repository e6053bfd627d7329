"""Validation of microcode: the ROM's bits compute the programs' results, for all inputs.

`Emulator`, written from `docs/engine.md` alone, executes the image stage by stage, one ROM word per
cycle, on terms instead of integers: inputs, parameters and states are symbols, every register,
capture and pipeline stage that an update does not define itself holds a symbol of its own. At the
end of an update each output, next state and saturation flag must be the term that the program's
operations define (`model.words.interpreter`), and no word that lasts from update to update may have
been written. A restart routine must write the initial words as next states, and no word that lasts
either. So the proof of one update is the proof of any number of them, in any order, with any
parameter writes, changes of program, restarts and abandoned updates between.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image, Refuted, decode
from boresight.model.words.fixed import wrap
from boresight.model.words.interpreter import Meaning, Terms
from boresight.model.words.program import ALWAYS, NEVER, Kind, Program, Scale

#: Values of the field ``scale``.
_SCALES = (Scale.NONE, Scale.FULL, Scale.EVEN, Scale.HALF)


@dataclass
class Record:
    """Result of one update: output words, register writes, ``last`` of all words in and out.

    A write is the cycle at whose end it happens, the register, and its word.
    """

    outputs: list[Any] = field(default_factory=list)
    writes: list[tuple[int, int, Any]] = field(default_factory=list)
    gets: list[bool] = field(default_factory=list)
    emits: list[bool] = field(default_factory=list)


class _Delay(deque[Any]):
    """Registers in a row: an item comes out as many cycles later as there are registers."""

    def through(self, item: Any) -> Any:
        """Put an item in; return the item that comes out in this cycle."""
        self.append(item)
        return self.popleft()


class _Lane:
    """Registers of one lane. Fields of the microword act at their stages, so only data wait."""

    def __init__(self, machine: Machine, domain: Any, number: int) -> None:
        def word(name: str) -> Any:
            return domain.symbol(f"left in {name} of lane {number}")

        def registers(name: str, first: int, last: int, content: Callable[[str], Any]) -> _Delay:
            return _Delay(content(f"{name}{k}") for k in reversed(range(first + 1, last + 1)))

        at = machine.stages
        self.operands = registers("ab", 0, at.read, lambda n: (word(n), word(f"{n} b")))
        self.products = registers("product", at.read, at.shift, word)
        self.conditions = registers(
            "condition", at.condition, at.shift, lambda n: [(False, word(n))] * 2
        )
        self.amounts = registers("amount", at.amount, at.shift, word)
        self.terms = registers("r", at.shift, at.accumulate, lambda n: (word(n), NEVER, ALWAYS))
        self.sums = registers("sum", at.limit, at.write, lambda n: (word(n), 0))
        self.acc, self.index, self.flag = word("acc"), word("index"), word("flag")
        self.counts = [word("norm1"), word("norm2")]  #: captured last, and a cycle before


class Emulator:
    """The machine with an image in its memories. The image passes `Image.check`.

    ``registers`` are the words of the register file, at first each a symbol of its own; ``number``
    is the selected program, to be set between updates; ``parities`` are the current copies of the
    states of each program; ``flagged`` are the words that raise a sticky flag.
    """

    def __init__(self, machine: Machine, image: Image, domain: Any) -> None:
        self.machine, self.image, self.domain = machine, image, domain
        self.number = 0
        self.parities = [0] * len(image.lengths)
        self.flagged = set[Any]()
        self.registers = [
            domain.symbol(f"left in register {k}") for k in range(len(image.registers))
        ]
        self._lanes = [_Lane(machine, domain, k) for k in range(machine.lanes)]
        #: Fields of each lane: their names in the microword, and without the lane's number.
        self._names = [
            [(f.name, f.name[:-1]) for f in machine.fields if f.name.endswith(str(k))]
            for k in range(machine.lanes)
        ]
        #: Registers that are written at the end of this cycle, and its number.
        self._writing, self._cycle = set[int](), 0

    def physical(self, address: int, parity: int) -> int:
        """Register address with the parity in bit c of the state region."""
        half = self.machine.bank_depth // 2
        if address % self.machine.bank_depth >= half and parity:
            address ^= half // 2
        return address

    def update(self, words: Sequence[Any]) -> Record:
        """Run an update of the selected program on the words of a record."""
        return self._run(self.number, iter(words))

    def restart(self) -> Record:
        """Run the restart routine of the selected program."""
        return self._run(self.number + len(self.parities), iter(()))

    def _run(self, part: int, words: Iterator[Any]) -> Record:
        """Run a program or restart routine, from its first word to its last."""
        record, lanes = Record(), range(self.machine.lanes)
        for cycle, code in enumerate(self.image.program(part)):
            self._cycle, word = cycle, decode(self.machine, code)
            fields = [{short: word[name] for name, short in names} for names in self._names]
            taken = [next(words, None) if word["get"] and k == 0 else None for k in lanes]
            if word["get"]:
                record.gets.append(bool(word["get_last"]))
            depth = self.machine.bank_depth
            addresses = [self._state(k * depth + fields[k]["dest"]) for k in lanes]
            self._writing = {addresses[k] for k in lanes if fields[k]["we"] or taken[k] is not None}
            if word["emit"]:
                record.outputs.append(self._lanes[0].operands[0][0])
                record.emits.append(bool(word["emit_last"]))
            results = [self._stages(self._lanes[k], fields[k], taken[k]) for k in lanes]
            for address, result in zip(addresses, results, strict=True):
                if result is not None:
                    self.registers[address] = result
                    record.writes.append((cycle, address, result))
        self.parities[self.number] ^= 1
        return record

    def _state(self, address: int) -> int:
        """Physical register of an address in a microword."""
        return self.physical(address, self.parities[self.number])

    def _read(self, address: int) -> Any:
        """Word at an address; one that is written in this cycle is not defined."""
        register = self._state(address)
        if register in self._writing:
            return self.domain.symbol(f"register {register} in the cycle of its write", self._cycle)
        return self.registers[register]

    def _stages(self, lane: _Lane, f: dict[str, int], taken: Any) -> Any:
        """Run all stages of one lane; return the word written, if any: ``taken``, or the result."""
        domain = self.domain
        # Read: captures of this cycle see the raw A; they are used one or two cycles later.
        a, b = lane.operands.popleft()
        conditions = [
            (bool(f[name]), lane.flag if f[f"{name}_flag"] else None) for name in ("neg", "when")
        ]
        amount = domain.amount(f["shift"], _SCALES[f["scale"]], lane.counts[1])
        lane.counts[1] = lane.counts[0]
        quarter = bool(f["quarter"])
        if f["cap_index"]:
            lane.index = domain.index(a, quarter=quarter)
        if f["cap_flag"]:
            lane.flag = domain.sign(a, quarter=quarter)
        if f["cap_norm"]:
            lane.counts[0] = domain.count(a)
        # Multiply the masked words, shift, accumulate, limit, write.
        factor_a = domain.fraction(a) if f["frac_a"] else a
        factor_b = domain.fraction(b) if f["frac_b"] else b
        product = lane.products.through(domain.product(factor_a, factor_b))
        negate, take = lane.conditions.through(conditions)
        shifted = domain.shifted(product, lane.amounts.through(amount))
        term = lane.terms.through((shifted, negate, take))
        total, wrap = lane.sums.through((lane.acc, f["wrap"]))
        lane.acc = domain.total(None if f["first"] else lane.acc, *term)
        result = taken
        if f["we"] and taken is None:
            result = domain.result(total, wrap=bool(wrap))
            if f["sticky"] and domain.may_overflow(result):
                self.flagged.add(result)
        # Address
        b_addr = f["b_addr"]
        if f["table"]:
            word_b = domain.coefficient(b_addr >> 2 & 3, b_addr & 3, lane.index)
        else:
            word_b = self._read(b_addr)
        lane.operands.append((self._read(f["a_addr"]), word_b))
        return result


def validate_microcode(
    machine: Machine,
    image: Image,
    programs: Sequence[Program],
    registers: Sequence[Mapping[int, int]],
) -> None:
    """Prove that an image computes its programs; the image passes `Image.check`.

    ``registers`` has for each program the register of each parameter and state, by number of the
    value (`Allocation.addresses`). Raises Refuted if some word differs for some input; the message
    names program, word and both terms.
    """
    core = _Core(machine, image, programs, registers)
    core.check_first_words()
    for number in range(len(programs)):
        for parity in (0, 1):  # from either copy of its states
            _Update(core, number, parity).check()
            _Update(core, number, parity).check_restart()


class _Core:
    """Data common to the proofs of all programs of a core."""

    def __init__(
        self,
        machine: Machine,
        image: Image,
        programs: Sequence[Program],
        registers: Sequence[Mapping[int, int]],
    ) -> None:
        self.machine, self.image, self.programs = machine, image, programs
        #: Register of each parameter and (current) state: (program, value) to address.
        self.lasting = {
            (k, n): where[n]
            for k, (program, where) in enumerate(zip(programs, registers, strict=True))
            for n in (*program.of_kind(Kind.PARAM), *program.of_kind(Kind.STATE))
        }
        depth, slots = machine.bank_depth, machine.state_slots
        words = {
            lane * depth + fields[f"dest{lane}"]
            for fields in (decode(machine, word) for word in image.rom)
            for lane in range(machine.lanes)
            if fields[f"we{lane}"] or (lane == 0 and fields["get"])
        } | {*self.lasting.values()}
        #: Registers that no program writes, nor the host; of the upper halves those whose two
        #: copies, which take turns, are equal.
        self.constants = {
            a
            for a in range(depth * machine.lanes)
            for b in [a ^ slots if a % depth >= depth // 2 else a]
            if not {a, b} & words and image.registers[a] == image.registers[b]
        }

    def check_first_words(self) -> None:
        """Check the words of parameters, states and tables before the first update."""
        mask = (1 << self.machine.arithmetic.word) - 1
        for (k, n), address in self.lasting.items():
            value = self.programs[k].values[n]
            copies = [0, self.machine.state_slots] if value.kind is Kind.STATE else [0]
            for copy in (address + offset for offset in copies):
                if self.image.registers[copy] != value.initial & mask:
                    raise Refuted(
                        f"{self.programs[k].name}: {value.name} must begin with {value.initial}, "
                        f"not with {self.image.registers[copy]} in register {copy}"
                    )
        for program in self.programs:
            for k, word in enumerate(program.table_memory):
                if self.image.tables[k] != word & mask:
                    raise Refuted(
                        f"{program.name}: word {k} of the tables must be {word}, "
                        f"not {self.image.tables[k]}"
                    )


class _Update:
    """One update of one program, from one copy of its states."""

    def __init__(self, core: _Core, number: int, parity: int) -> None:
        self.core = core
        self.program = core.programs[number]
        self.terms = Terms(core.machine.arithmetic)
        self.emulator = emulator = Emulator(core.machine, core.image, self.terms)
        emulator.number, emulator.parities[number] = number, parity
        for address in core.constants:
            word = wrap(core.image.registers[address], core.machine.arithmetic.word)
            emulator.registers[address] = self.terms.word(word)
        #: Symbol and physical register of each parameter and state of any program.
        self.symbols, self.registers = dict[tuple[int, int], int](), dict[tuple[int, int], int]()
        for (k, n), address in core.lasting.items():
            self.symbols[k, n] = self.terms.symbol(self._name(k, n), n)
            self.registers[k, n] = emulator.physical(address, emulator.parities[k])
            emulator.registers[self.registers[k, n]] = self.symbols[k, n]

    def _name(self, k: int, n: int) -> str:
        return f"{self.core.programs[k].name}.{self.core.programs[k].values[n].name}"

    def check(self) -> None:
        """Raise Refuted unless the update computes the program's results."""
        program, number = self.program, self.emulator.number
        inputs = {
            n: self.terms.symbol(f"input {program.values[n].name}", n) for n in program.inputs
        }
        record = self.emulator.update([*inputs.values()])
        for what, lasts, words in (
            ("take", record.gets, program.inputs),
            ("emit", record.emits, program.outputs),
        ):
            if lasts != [k == len(words) - 1 for k in range(len(words))]:
                raise Refuted(
                    f"{program.name}: the microcode must {what} {len(words)} words, the last one "
                    f"marked, not {lasts}"
                )
        symbols = {n: s for (k, n), s in self.symbols.items() if k == number}
        meaning = Meaning.of(program, self.terms, symbols | inputs)
        self._check_writes(record)
        text = self.terms.text
        for what, word, wanted in self._words(record, meaning):
            if word != wanted:
                raise Refuted(f"{program.name}: {what} must be {text(wanted)}, not {text(word)}")
        if self.emulator.flagged != meaning.flagged:
            differ = self.emulator.flagged ^ meaning.flagged
            raise Refuted(f"{program.name}: a sticky flag differs by {text(min(differ))}")

    def check_restart(self) -> None:
        """Raise Refuted unless the restart routine loads the initial words of the states."""
        record = self.emulator.restart()
        self._check_writes(record)
        for state, word in self._next_states():
            value = self.program.values[state]
            if word != self.terms.word(value.initial):
                raise Refuted(
                    f"{self.program.name}: a restart must load {value.name} with {value.initial}, "
                    f"not {self.terms.text(word)}"
                )
        if record.outputs or self.emulator.flagged:
            raise Refuted(f"{self.program.name}: a restart must neither emit nor raise a flag")

    def _next_states(self) -> Iterator[tuple[int, int]]:
        """Each state, and the term in its register for the next update."""
        number = self.emulator.number
        for state, _ in self.program.states:
            address = self.core.lasting[number, state]
            register = self.emulator.physical(address, self.emulator.parities[number])
            yield state, self.emulator.registers[register]

    def _words(self, record: Record, meaning: Meaning) -> Iterator[tuple[str, int, int]]:
        """Each word that leaves or lasts: its name, its term in the microcode, in the program."""
        program, after = self.program, dict(self.program.states)
        names = program.output_names
        for name, word, n in zip(names, record.outputs, program.outputs, strict=True):
            yield f"output {name}", word, meaning.values[n]
        for state, word in self._next_states():
            yield f"next {program.values[state].name}", word, meaning.values[after[state]]

    def _check_writes(self, record: Record) -> None:
        """Check that the update writes no word that lasts: it may be abandoned in any cycle."""
        lasting = {address: item for item, address in self.registers.items()}
        for (k, n), address in self.core.lasting.items():
            # Either copy of another program's state is its own.
            if k != self.emulator.number:
                lasting |= {self.emulator.physical(address, parity): (k, n) for parity in (0, 1)}
        for cycle, address, _ in record.writes:
            if address in lasting:
                raise Refuted(
                    f"{self.program.name}: cycle {cycle} writes "
                    f"{self._name(*lasting[address])}, register {address}"
                )
