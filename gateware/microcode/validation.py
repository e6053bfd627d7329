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

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.emulator import Emulator, Record
from boresight.gateware.microcode.image import Image, decode
from boresight.model.words.fixed import wrap
from boresight.model.words.program import Kind, Program
from boresight.model.words.terms import Meaning, Refuted, Terms


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
        #: Symbol of each parameter and state of any program.
        self.symbols = {(k, n): self.terms.symbol(self._name(k, n), n) for k, n in core.lasting}
        #: Physical register of each of them.
        self.registers = {
            (k, n): emulator.physical(address, emulator.parities[k])
            for (k, n), address in core.lasting.items()
        }
        for item, address in self.registers.items():
            emulator.registers[address] = self.symbols[item]

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
        for name, word, n in zip(
            program.output_names, record.outputs, program.outputs, strict=True
        ):
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
