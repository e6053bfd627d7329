"""Images: microcode and initial memory contents of an engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from boresight.gateware.machine import Machine


def rom_pieces(words: int) -> tuple[int, ...]:
    """Depths of the memories that form a ROM of ``words`` words, the deepest first.

    Each is a power of two, like block RAM, and at most half of the one before, so that one address
    bit each selects the memory of a word.
    """
    blocks = max(2, -(-words // 256))
    return tuple(256 << k for k in reversed(range(blocks.bit_length())) if blocks >> k & 1)


@dataclass(frozen=True)
class Image:
    """Contents of an engine's memories for one program or several."""

    #: Microwords in order, bits as in `Machine.fields`: the programs one after another, then their
    #: restart routines; at most ``Machine.rom_words``.
    rom: list[int]
    #: Initial register file, unsigned words; index = bank * bank_depth + offset.
    registers: list[int]
    #: Function tables, 1536 unsigned words; index = 512 * block + 4 * segment + coefficient.
    tables: list[int]
    #: Cycles of each program: words of the ROM that run.
    lengths: tuple[int, ...]
    #: Identifier of the build; its low 2 W bits can be read on the bus.
    digest: int = 0
    #: Cycles of each program's restart routine, which writes the initial words of its states as its
    #: next states. Empty: the programs keep their states after a reset.
    restarts: tuple[int, ...] = ()

    @property
    def ends(self) -> tuple[int, ...]:
        """Address behind the last word of each program, then of each restart routine."""
        return tuple(accumulate((*self.lengths, *self.restarts)))

    @property
    def bases(self) -> tuple[int, ...]:
        """Address of the first word of each program, then of each restart routine."""
        return (0, *self.ends[:-1])

    @property
    def starts(self) -> list[int]:
        """Address of the first word by the program's number, above it the bit for its restart.

        A number that no program has leads to program 0, so that an upset register does no harm.
        """
        count = len(self.lengths)
        size = 1 << (count - 1).bit_length()
        halves = self.bases[:count], self.bases[count:] or self.bases
        return [base for half in halves for base in (*half, *[0] * (size - count))]

    def program(self, number: int) -> list[int]:
        """Microwords of a program; of restart routine k with number = programs + k."""
        return self.rom[self.bases[number] : self.ends[number]]

    @classmethod
    def join(cls, images: Sequence[Image], *, digest: int) -> Image:
        """Join the images of programs with common registers.

        Raises
        ------
        ValueError
            Registers differ, or tables that both use.
        """
        tables = next((x.tables for x in images if any(x.tables)), images[0].tables)
        for image in images:
            if image.registers != images[0].registers:
                raise ValueError("registers of the programs must be common")
            if any(image.tables) and image.tables != tables:
                raise ValueError("function tables of the programs must be the same")
        programs = [w for x in images for w in x.rom[: sum(x.lengths)]]
        return replace(
            images[0],
            rom=programs + [w for x in images for w in x.rom[sum(x.lengths) :]],
            tables=tables,
            lengths=tuple(n for x in images for n in x.lengths),
            digest=digest,
            restarts=tuple(n for x in images for n in x.restarts),
        )

    def check(self, machine: Machine) -> None:
        """Raise ValueError where the image breaks a rule that its proof does not see.

        Only the last word of a program or restart routine returns, none both gets and emits, and a
        program gets an input word, a routine none.
        """
        bits, count = self._positions(machine), len(self.lengths)
        for number in range(len(self.bases)):
            words = self.program(number)
            homes, gets, emits = (
                [word >> bits[name] & 1 for word in words] for name in ("home", "get", "emit")
            )
            both = any(get & emit for get, emit in zip(gets, emits, strict=True))
            is_long = len(words) > machine.prefetch
            returns = homes == [0] * (len(words) - 1) + [1]
            if not is_long or not returns or both or any(gets) != (number < count):
                base = self.bases[number]
                raise ValueError(f"microcode from word {base} on breaks docs/engine.md")

    @staticmethod
    def _positions(machine: Machine) -> dict[str, int]:
        """Lowest bit of every field."""
        out, position = {}, 0
        for field in machine.fields:
            out[field.name] = position
            position += field.width
        return out

    def hardware_rom(self, machine: Machine) -> tuple[list[int], ...]:
        """Contents of each of `rom_pieces`, with ``home`` `Machine.prefetch` words earlier.

        The program counter is ahead of the executed word by so many.
        """
        home = 1 << self._positions(machine)["home"]
        rom = [value & ~home for value in self.rom]
        for end in self.ends:
            rom[end - 1 - machine.prefetch] |= home
        pieces = rom_pieces(len(rom))
        rom += [0] * sum(pieces)  # at least as many as are missing; the rest is cut off
        ends = accumulate(pieces)
        return tuple(rom[end - depth : end] for depth, end in zip(pieces, ends, strict=True))
