"""The boards, and the pins of a design's lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from amaranth.build import Attrs, Pins, Resource

from boresight.gateware.boards.clock import Clock, Ecp5Clock, Ice40Clock, Spartan6Clock
from boresight.model.tools.external import optional


@dataclass(frozen=True)
class Line:
    """A line between a design and a board's connector."""

    #: Port of the design.
    name: str
    #: Key of `Board.positions`; "led0", "led1" for the LEDs.
    place: str
    #: For README and pin table.
    meaning: str
    #: Inputs of the FPGA are asynchronous and pass two flip-flops.
    input: bool = False
    #: Whether a pull-up keeps an open input high.
    pull_up: bool = False


#: Attributes of pins at 3.3 V: of all, of those with a pull-up, of outputs. Outputs are registered:
#: the same delay in every build; short lines, slow edges.
Pads = tuple[Mapping[str, Any], Mapping[str, Any], Mapping[str, Any]]

_SPARTAN6_PADS = ({"IOSTANDARD": "LVCMOS33"}, {"PULLUP": "TRUE"}, {"SLEW": "SLOW", "DRIVE": "8"})
_ICE40_PADS = ({"IO_STANDARD": "SB_LVCMOS"}, {"PULLUP": 1}, dict[str, str]())
_ECP5_PADS = ({"IO_TYPE": "LVCMOS33"}, {"PULLMODE": "UP"}, {"SLEWRATE": "SLOW", "DRIVE": "8"})


@dataclass(frozen=True)
class Board:
    """A board."""

    title: str
    #: Module and class of amaranth-boards.
    platform: str
    oscillator_hz: int
    #: Its name in amaranth-boards.
    connector: tuple[str, int]
    #: By `Line.place`: the position on ``connector``, by the numbering of amaranth-boards, or
    #: RESOURCE.PART of a part on the board, ``uart.rx``.
    positions: Mapping[str, str]
    #: Positions on ``connector``; none: the board has its own.
    leds: tuple[str, ...] = ()
    #: Part of the board (`gateware.synthesis.targets`).
    target: str = "xc6slx9"
    clocking: type[Clock] = Spartan6Clock
    pads: Pads = _SPARTAN6_PADS
    #: RESOURCE.PART of the board that is driven high: resource "held" of the platform, by number.
    high_parts: tuple[str, ...] = ()
    #: Whether the complete system fits its part; else only a core that the host feeds does.
    holds_system: bool = True

    def make(self, lines: Sequence[Line]) -> Any:
        """Return the platform, with a resource for each line, named like it."""
        module, _, name = self.platform.partition(":")
        platform = _in_rtlil(getattr(optional(f"amaranth_boards.{module}"), name))()
        every, pull_up, output = self.pads
        for line in lines:
            if line.place.startswith("led"):
                continue
            attrs = {**every, **(pull_up if line.pull_up else {}), **({} if line.input else output)}
            pin = self._pin(platform, self.positions[line.place], "i" if line.input else "o")
            platform.add_resources([Resource(line.name, 0, pin, Attrs(**attrs))])
        for number, place in enumerate(self.high_parts):
            pin = self._pin(platform, place, "o")
            platform.add_resources([Resource("held", number, pin, Attrs(**every))])
        if self.leds:
            make = optional("amaranth_boards.resources").LEDResources
            pins = " ".join(self.leds)
            platform.add_resources(make(pins=pins, conn=self.connector, attrs=Attrs(**every)))
        return platform

    def _pin(self, platform: Any, position: str, direction: str) -> Pins:
        """A pin by its position."""
        resource, dot, part = position.partition(".")
        if not dot:
            return Pins(position, dir=direction, conn=self.connector)
        (pins,) = (sub.ios[0] for sub in platform.lookup(resource).ios if sub.name == part)
        return Pins(" ".join(pins.names), dir=direction)

    def where(self, line: Line) -> tuple[str, str]:
        """Position on the connector, and meaning: without the adapter that the board itself has."""
        place, led = line.place, line.place.removeprefix("led")
        position = (
            dict(enumerate(self.leds)).get(int(led)) if led != place else self.positions[place]
        )
        if position is None or "." in position:
            return "on the board", line.meaning.partition(":")[0] if led == place else line.meaning
        return f"{self.header} position {position}", line.meaning

    @property
    def header(self) -> str:
        """Name of the connector."""
        return f"{self.connector[0]}_{self.connector[1]}"


def _in_rtlil(platform: type[Any]) -> type[Any]:
    """A platform whose build plan has RTLIL in place of Verilog, which then needs no yosys."""

    class InRtlil(platform):
        @property
        def file_templates(self) -> Mapping[str, str]:
            kept = {k: v for k, v in super().file_templates.items() if not k.endswith(".v")}
            return {**kept, "{{name}}.il": "{{emit_rtlil()}}"}

    return InRtlil


def _row(names: str, first: int) -> dict[str, str]:
    """Positions of the connector in a row."""
    return {name: str(first + k) for k, name in enumerate(names.split())}


_ROW = "adis_cs_n adis_sclk adis_mosi adis_miso adis_data_ready adis_reset_n hmr_rx hmr_tx"

#: Boards by name. ISE projects do not use the flash memory: amaranth-boards has a wrong pin for it.
BOARDS = {
    "mimas": Board(
        "Numato Mimas",
        "numato_mimas:NumatoMimasPlatform",
        100_000_000,
        ("p", 1),
        {"host_rx": "3", "host_tx": "4", **_row(_ROW, 5)},
    ),
    "sk-xc6slx9": Board(
        "SK-XC6SLX9",
        "sk_xc6slx9:SK_XC6SLX9Platform",
        50_000_000,
        ("x", 7),
        {"host_rx": "3", "host_tx": "5", **_row(_ROW, 8)},
        leds=("6", "7"),
    ),
    "ulx3s": Board(
        "ULX3S (85F)",
        "ulx3s:ULX3S_85F_Platform",
        25_000_000,
        ("gpio", 0),
        {
            **{name: f"{k // 2}{'+-'[k % 2]}" for k, name in enumerate(_ROW.split())},
            "host_rx": "uart.rx",
            "host_tx": "uart.tx",
        },
        target="ecp5-85k",
        clocking=Ecp5Clock,
        pads=_ECP5_PADS,
        # Low, it starts the board's ESP32 in its boot loader.
        high_parts=("esp32.gpio0",),
    ),
    "icebreaker": Board(
        "iCEBreaker",
        "icebreaker:ICEBreakerPlatform",
        12_000_000,
        ("pmod", 0),
        {
            **_row("adis_cs_n adis_sclk adis_mosi adis_miso", 1),
            **_row("adis_data_ready adis_reset_n hmr_rx hmr_tx", 7),
            "host_rx": "uart.rx",
            "host_tx": "uart.tx",
        },
        target="ice40-up5k",
        clocking=Ice40Clock,
        pads=_ICE40_PADS,
        holds_system=False,
    ),
}
