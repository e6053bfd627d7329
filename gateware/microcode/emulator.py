"""Cycle-level emulator of the machine, written from `docs/engine.md` alone.

It executes an image like the hardware, stage by stage, one ROM word per cycle. Its words are those
of any domain of `model.words.program.total_of`; `gateware.microcode.validation` executes terms.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image, decode
from boresight.model.words.program import ALWAYS, NEVER, Scale

#: Values of the field ``scale``.
_SCALES = (Scale.NONE, Scale.FULL, Scale.EVEN, Scale.HALF)


@dataclass(frozen=True)
class Write:
    """A register written at the end of ``cycle`` (cycles with the machine running)."""

    cycle: int
    address: int
    word: Any


@dataclass
class Record:
    """Result of one update: output words, register writes, ``last`` of all words in and out."""

    outputs: list[Any] = field(default_factory=list)
    writes: list[Write] = field(default_factory=list)
    gets: list[bool] = field(default_factory=list)
    emits: list[bool] = field(default_factory=list)


class _Delay(deque[Any]):
    """Registers in a row: an item comes out as many cycles later as there are registers."""

    def through(self, item: Any) -> Any:
        """Put an item in; return the item that comes out in this cycle."""
        self.append(item)
        return self.popleft()


class _Lane:
    """Registers of one lane. Fields of the microword act at their stages, so only data wait.

    ``word`` is the first content of a register with this name.
    """

    def __init__(self, machine: Machine, word: Callable[[str], Any]) -> None:
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

    Attributes
    ----------
    registers : list
        Words of the register file; at first each is a symbol of its own.
    number : int
        Number of the selected program; to be set between updates.
    parities : list of int
        Parity of each program: the current copy of its states.
    flagged : set
        Words that raise a sticky flag.
    """

    def __init__(self, machine: Machine, image: Image, domain: Any) -> None:
        self.machine, self.image, self.domain = machine, image, domain
        self.number = 0
        self.parities = [0] * len(image.lengths)
        self.flagged = set[Any]()
        self.registers = [
            domain.symbol(f"left in register {k}") for k in range(len(image.registers))
        ]
        self._lanes = [self._lane(k) for k in range(machine.lanes)]
        #: Registers that are written at the end of this cycle, and its number.
        self._writing, self._cycle = set[int](), 0

    def _lane(self, number: int) -> _Lane:
        """A lane before the first update."""
        return _Lane(
            self.machine, lambda name: self.domain.symbol(f"left in {name} of lane {number}")
        )

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
            fields = [
                {name[:-1]: v for name, v in word.items() if name.endswith(str(k))} for k in lanes
            ]
            taken = [next(words, None) if word["get"] and k == 0 else None for k in lanes]
            if word["get"]:
                record.gets.append(bool(word["get_last"]))
            addresses = [
                self._state(k * self.machine.bank_depth + f["dest"]) for k, f in enumerate(fields)
            ]
            self._writing = {addresses[k] for k in lanes if fields[k]["we"] or taken[k] is not None}
            if word["emit"]:
                record.outputs.append(self._lanes[0].operands[0][0])
                record.emits.append(bool(word["emit_last"]))
            results = [self._stages(self._lanes[k], fields[k], taken[k]) for k in lanes]
            for address, result in zip(addresses, results, strict=True):
                if result is not None:
                    self.registers[address] = result
                    record.writes.append(Write(cycle, address, result))
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
        block, coefficient = f["b_addr"] >> 2 & 3, f["b_addr"] & 3
        word_b = (
            domain.coefficient(block, coefficient, lane.index)
            if f["table"]
            else self._read(f["b_addr"])
        )
        lane.operands.append((self._read(f["a_addr"]), word_b))
        return result
