"""The two boards, and the pins of a design's lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from amaranth.build import Attrs, Pins, Resource
from amaranth_boards.numato_mimas import NumatoMimasPlatform
from amaranth_boards.resources import LEDResources
from amaranth_boards.sk_xc6slx9 import SK_XC6SLX9Platform


@dataclass(frozen=True)
class Line:
    """A line between a design and a board's connector.

    Parameters
    ----------
    name : str
        Port of the design.
    place : str
        Key of `Board.positions`; "led0", "led1" for the LEDs.
    meaning : str
        Description, for README and pin table.
    input : bool
        Whether the line is an input of the FPGA. Inputs are asynchronous and pass two flip-flops.
    pull_up : bool
        Whether a pull-up keeps an open input high.
    """

    name: str
    place: str
    meaning: str
    input: bool = False
    pull_up: bool = False


@dataclass(frozen=True)
class Board:
    """A board.

    ``positions`` and ``leds`` are positions on ``connector``, by the numbering of amaranth-boards;
    no ``leds``: the board has its own.
    """

    title: str
    platform: type[Any]
    oscillator_hz: int
    connector: tuple[str, int]
    positions: Mapping[str, str]
    leds: tuple[str, ...] = ()

    def make(self, lines: Sequence[Line]) -> Any:
        """Return the platform, with a resource for each line, named like it."""
        platform = self.platform()
        for line in lines:
            if line.place.startswith("led"):
                continue
            attrs = {"IOSTANDARD": "LVCMOS33", **({"PULLUP": "TRUE"} if line.pull_up else {})}
            if not line.input:  # registered: the same delay in every build; short lines, slow edges
                attrs |= {"SLEW": "SLOW", "DRIVE": "8"}
            platform.add_resources(
                [
                    Resource(
                        line.name,
                        0,
                        Pins(
                            self.positions[line.place],
                            dir="i" if line.input else "o",
                            conn=self.connector,
                        ),
                        Attrs(**attrs),
                    )
                ]
            )
        if self.leds:
            platform.add_resources(
                LEDResources(
                    pins=" ".join(self.leds),
                    conn=self.connector,
                    attrs=Attrs(IOSTANDARD="LVCMOS33"),
                )
            )
        return platform

    def where(self, line: Line) -> str:
        """Position on the connector, for texts."""
        if not line.place.startswith("led"):
            return f"{self.header} position {self.positions[line.place]}"
        number = int(line.place.removeprefix("led"))
        return f"{self.header} position {self.leds[number]}" if self.leds else "on the board"

    @property
    def header(self) -> str:
        """Name of the connector."""
        return f"{self.connector[0]}_{self.connector[1]}"


def _row(names: str, first: int) -> dict[str, str]:
    """Positions of the connector in a row."""
    return {name: str(first + k) for k, name in enumerate(names.split())}


_ROW = (
    "adis_cs_n adis_sclk adis_mosi adis_miso adis_data_ready adis_reset_n hmr_rx hmr_tx "
    "console_rx console_tx"
)

#: Boards by name. Projects do not use the flash memory: amaranth-boards has a wrong pin for it.
BOARDS = {
    "mimas": Board(
        "Numato Mimas",
        NumatoMimasPlatform,
        100_000_000,
        ("p", 1),
        {"host_rx": "3", "host_tx": "4", **_row(_ROW, 5)},
    ),
    "sk-xc6slx9": Board(
        "SK-XC6SLX9",
        SK_XC6SLX9Platform,
        50_000_000,
        ("x", 7),
        {"host_rx": "3", "host_tx": "5", **_row(_ROW, 8)},
        leds=("6", "7"),
    ),
}
