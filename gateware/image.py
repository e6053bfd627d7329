"""What is loaded into an engine: microcode and initial memory contents."""

from __future__ import annotations

from dataclasses import dataclass

from gateware.machine import Machine

__all__ = ["Image"]


@dataclass(frozen=True)
class Image:
    """Contents of an engine's memories for one program.

    Parameters
    ----------
    rom : list of int
        Microwords in order, bits as in `Machine.fields`; at most ``Machine.rom_words``.
    registers : list of int
        Initial register file, 512 unsigned words; index = bank * bank_depth + offset.
    tables : list of int
        Function tables, 1536 unsigned words; index = 512 * block + 4 * segment + coefficient.
    length : int
        Cycles of the program: words of the ROM that run.
    digest : int
        Identifier of the build; its low 2 W bits can be read on the bus.
    """

    rom: list[int]
    registers: list[int]
    tables: list[int]
    length: int
    digest: int = 0

    def check(self, machine: Machine) -> None:
        """Raise ValueError unless the image fits ``machine``."""
        word = 1 << machine.arithmetic.word
        for name, words, count, limit in (
                ("rom", self.rom, None, 1 << machine.word_bits),
                ("registers", self.registers, 1 << machine.register_bits, word),
                ("tables", self.tables, machine.TABLE_BLOCK * machine.TABLE_BLOCKS, word)):
            if count is not None and len(words) != count:
                raise ValueError(f"{name} must have {count} words, not {len(words)!r}")
            for number, value in enumerate(words):
                if not 0 <= value < limit:
                    raise ValueError(f"{name}[{number}] must be below {limit:#x}, not {value!r}")
        if not len(self.rom) <= machine.rom_words:
            raise ValueError(f"rom must have at most {machine.rom_words} words, "
                             f"not {len(self.rom)!r}")
        if not 2 <= self.length <= len(self.rom):
            raise ValueError(f"length must be 2 to {len(self.rom)}, not {self.length!r}")
        if self.digest < 0:
            raise ValueError(f"digest must not be negative, not {self.digest!r}")

        bit = self._positions(machine)
        for number, value in enumerate(self.rom[:self.length]):
            home = value >> bit["home"] & 1
            if home != (number == self.length - 1):
                raise ValueError(f"rom[{number}] must have home = {1 - home}, not {home!r}: "
                                 "only the last word of the program returns")
            if value >> bit["get"] & value >> bit["emit"] & 1:
                raise ValueError(f"rom[{number}] must not get and emit in the same cycle")
        if not any(value >> bit["get"] & 1 for value in self.rom[:self.length]):
            raise ValueError("rom must get at least one input word")

    @staticmethod
    def _positions(machine: Machine) -> dict[str, int]:
        """Lowest bit of every field."""
        out, position = {}, 0
        for field in machine.fields():
            out[field.name] = position
            position += field.width
        return out

    def rom_early_home(self, machine: Machine) -> list[int]:
        """The ROM with ``home`` one word earlier, filled up to the ROM's depth.

        The program counter runs one word ahead of the ROM's output, so that it is the last word
        but one that must send it back.
        """
        home = 1 << self._positions(machine)["home"]
        rom = [value & ~home for value in self.rom]
        rom[self.length - 2] |= home
        return rom + [0] * (machine.rom_words - len(rom))
