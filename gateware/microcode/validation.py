"""Validation of microcode: the ROM's bits compute the programs' results, for all inputs.

The emulator executes one update of each program on terms instead of integers: inputs, parameters
and states are symbols, every register, capture and pipeline stage that an update does not define
itself holds a symbol of its own. At the end each output, next state and saturation flag must be
the term that the program's operations define (`model.words.terms`), and no word that lasts from
update to update may have been written. A restart routine must write the initial words as next
states, and no word that lasts either. So the proof of one update is the proof of any number of
them, in any order, with any parameter writes, changes of program, restarts and abandoned updates
between.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.assemble import decode
from boresight.gateware.microcode.emulator import Emulator, Lane, Record
from boresight.gateware.microcode.image import Image
from boresight.model.words.program import Kind, Program, Scale
from boresight.model.words.terms import ALWAYS, NEVER, Condition, Meaning, Refuted, Terms

#: Values of the field ``scale``.
_SCALES = (Scale.NONE, Scale.FULL, Scale.EVEN, Scale.HALF)


def validate_microcode(
    machine: Machine,
    image: Image,
    programs: Sequence[Program],
    registers: Sequence[Mapping[int, int]],
) -> int:
    """Prove that an image computes its programs; return the number of their operations.

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
    return sum(len(program.ops) for program in programs)


class _Core:
    """Data common to the proofs of all programs of a core."""

    def __init__(
        self,
        machine: Machine,
        image: Image,
        programs: Sequence[Program],
        registers: Sequence[Mapping[int, int]],
    ) -> None:
        self.machine = machine
        self.image = image
        self.programs = programs
        #: Register of each parameter and (current) state: (program, value) to address.
        self.lasting = {
            (k, n): where[n]
            for k, (program, where) in enumerate(zip(programs, registers, strict=True))
            for n in (*program.of_kind(Kind.PARAM), *program.of_kind(Kind.STATE))
        }
        half, slots = machine.bank_depth // 2, machine.state_slots
        words = {
            (lane * machine.bank_depth + fields[f"dest{lane}"])
            for fields in (decode(machine, word) for word in image.rom)
            for lane in range(machine.lanes)
            if fields[f"we{lane}"] or (lane == 0 and fields["get"])
        } | {*self.lasting.values()}
        pairs = {
            address: address ^ slots if address % machine.bank_depth >= half else address
            for address in range(machine.bank_depth * machine.lanes)
        }
        #: Registers that no program writes, nor the host; of the upper halves those whose two
        #: copies, which take turns, are equal.
        self.constants = {
            a
            for a, b in pairs.items()
            if not {a, b} & words and image.registers[a] == image.registers[b]
        }

    def check_first_words(self) -> None:
        """Check the words of parameters, states and tables before the first update."""
        mask = (1 << self.machine.arithmetic.word) - 1
        for (k, n), address in self.lasting.items():
            value = self.programs[k].values[n]
            copies = {address}
            if value.kind is Kind.STATE:
                copies.add(address + self.machine.state_slots)
            for copy in sorted(copies):
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


class _Symbolic(Emulator):
    """The emulator on terms; ``flagged`` is the set of words that raise a flag."""

    def __init__(self, machine: Machine, image: Image, terms: Terms) -> None:
        self.terms = terms
        super().__init__(machine, image)
        self.flagged: set[int] = set()
        self.registers = [terms.symbol(f"left in register {k}") for k in range(len(self.registers))]

    def _read(self, register: int) -> int:
        """A memory does not define the word that is read while it is written."""
        if register in self.writing:
            return self.terms.symbol(f"register {register} in the cycle of its write", self.cycle)
        return super()._read(register)

    def _lane(self, number: int) -> Lane:
        def word(name: str) -> int:
            return self.terms.symbol(f"left in {name} of lane {number}")

        return Lane(
            self.machine.stages,
            word,
            lambda name: (False, word(name)),
            lambda name: (word(name), NEVER, ALWAYS),
        )

    def _result(self, acc: int, *, wrap: bool, sticky: bool) -> int:
        word = self.terms.result(acc, wrap=wrap)
        if sticky and self.terms.may_overflow(word):
            self.flagged.add(word)
        return word

    def _sum(self, acc: int | None, shifted: Any) -> int:
        return self.terms.total(acc, *shifted)

    def _shifted(self, product: int, amount: int, negate: Any, take: Any) -> Any:
        return self.terms.shifted(product, amount), negate, take

    def _amount(self, shift: int, scale: int, count: int) -> int:
        return self.terms.amount(shift, _SCALES[scale], count)

    def _product(self, a: int, b: int) -> int:
        return self.terms.product(a, b)

    def _condition(self, bit: int, flagged: int, flag: int) -> Condition:
        return bool(bit), flag if flagged else None

    def _fraction(self, word: int) -> int:
        return self.terms.fraction(word)

    def _coefficient(self, block: int, coefficient: int, index: int) -> int:
        return self.terms.coefficient(block, coefficient, index)

    def _index(self, word: int, quarter: int) -> int:
        return self.terms.index(word, quarter=bool(quarter))

    def _sign(self, word: int, quarter: int) -> int:
        return self.terms.sign(word, quarter=bool(quarter))

    def _count(self, word: int) -> int:
        return self.terms.count(word)


class _Update:
    """One update of one program, from one copy of its states."""

    def __init__(self, core: _Core, number: int, parity: int) -> None:
        self.core = core
        self.program = core.programs[number]
        self.terms = Terms(core.machine.arithmetic)
        self.emulator = _Symbolic(core.machine, core.image, self.terms)
        self.emulator.select(number)
        self.emulator.parities[number] = parity
        for address in core.constants:
            word = self.emulator._signed(core.image.registers[address])
            self.emulator.registers[address] = self.terms.word(word)
        #: Symbol of each parameter and state of any program.
        self.symbols = {(k, n): self.terms.symbol(self._name(k, n), n) for k, n in core.lasting}
        #: Physical register of each of them.
        self.registers = {
            (k, n): self._physical(address, self.emulator.parities[k])
            for (k, n), address in core.lasting.items()
        }
        for item, address in self.registers.items():
            self.emulator.registers[address] = self.symbols[item]

    def _name(self, k: int, n: int) -> str:
        return f"{self.core.programs[k].name}.{self.core.programs[k].values[n].name}"

    def _physical(self, address: int, parity: int) -> int:
        return self.emulator.physical(address, parity)

    def check(self) -> None:
        """Raise Refuted unless the update computes the program's results."""
        program, number = self.program, self.emulator.number
        inputs = {
            n: self.terms.symbol(f"input {program.values[n].name}", n) for n in program.inputs
        }
        try:
            record = self.emulator.update([inputs[n] for n in program.inputs])
        except IndexError:
            raise Refuted(f"{program.name}: the microcode leaves the program") from None
        if self.emulator.framing or self.emulator.pc != 0 or not record.cycles:
            raise Refuted(f"{program.name}: the microcode must take {len(inputs)} words, once")
        symbols = {n: s for (k, n), s in self.symbols.items() if k == number}
        meaning = Meaning.of(program, self.terms, symbols | inputs)
        self._check_writes(record)
        for what, word, wanted in self._words(record, meaning):
            if word != wanted:
                raise Refuted(self._difference(what, word, wanted, meaning, record))
        if self.emulator.flagged != meaning.flagged:
            differ = self.emulator.flagged ^ meaning.flagged
            raise Refuted(
                f"{program.name}: a sticky flag differs by {self.terms.text(min(differ))}"
            )

    def check_restart(self) -> None:
        """Raise Refuted unless the restart routine loads the initial words of the states."""
        program, number = self.program, self.emulator.number
        try:
            record = self.emulator.restart()
        except IndexError:
            raise Refuted(f"{program.name}: a restart leaves its routine") from None
        self._check_writes(record)
        for state, _ in program.states:
            address = self._physical(self.core.lasting[number, state], self.emulator.parity)
            word, value = self.emulator.registers[address], program.values[state]
            if word != self.terms.word(value.initial):
                raise Refuted(
                    f"{program.name}: a restart must load {value.name} with {value.initial}, "
                    f"not {self.terms.text(word)}"
                )
        if record.outputs or self.emulator.flagged:
            raise Refuted(f"{program.name}: a restart must neither emit nor raise a flag")

    def _words(self, record: Record, meaning: Meaning) -> Iterator[tuple[str, int, int]]:
        """Each word that leaves or lasts: its name, its term in the microcode, in the program."""
        program, number = self.program, self.emulator.number
        ends = [k == len(program.outputs) - 1 for k in range(len(program.outputs))]
        if record.lasts != ends:
            raise Refuted(
                f"{program.name}: the microcode must emit {len(ends)} words, the last one marked, "
                f"not {record.lasts}"
            )
        for name, word, n in zip(
            program.output_names, record.outputs, program.outputs, strict=True
        ):
            yield f"output {name}", word, meaning.values[n]
        for state, after in program.states:
            address = self._physical(self.core.lasting[number, state], self.emulator.parity)
            name = program.values[state].name
            yield f"next {name}", self.emulator.registers[address], meaning.values[after]

    def _check_writes(self, record: Record) -> None:
        """Check that the update writes no word that lasts: it may be abandoned in any cycle."""
        lasting = {address: item for item, address in self.registers.items()}
        for (k, n), address in self.core.lasting.items():
            # Either copy of another program's state is its own.
            if k != self.emulator.number:
                lasting |= {self._physical(address, parity): (k, n) for parity in (0, 1)}
        for write in record.writes:
            if write.address in lasting:
                raise Refuted(
                    f"{self.program.name}: cycle {write.cycle} writes "
                    f"{self._name(*lasting[write.address])}, register {write.address}"
                )

    def _difference(
        self, what: str, word: int, wanted: int, meaning: Meaning, record: Record
    ) -> str:
        """Message about the first operation whose word the update never computes."""
        program = self.program
        computed = {write.word for write in record.writes}
        missing = (op for op in program.ops if meaning.values[op.dest] not in computed)
        first = next(missing, None)
        text = (
            f"{program.name}: {what} must be {self.terms.text(wanted)}, not {self.terms.text(word)}"
        )
        if first is None:
            return text
        value = program.values[first.dest]
        return (
            f"{text}; operation {program.ops.index(first)} ({value.name}) is the first that no "
            "register receives"
        )
