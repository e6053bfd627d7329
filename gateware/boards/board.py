"""The boards, and a design on one: the shell around it, its build plan, the files written."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from unittest import mock

from amaranth.build import Attrs, Pins, Resource
from amaranth.hdl import ClockDomain, Elaboratable, Module

from boresight.gateware.boards.clock import Clock, Ecp5Clock, Ice40Clock, Spartan6Clock
from boresight.gateware.synthesis.routed import Routed, netlist_for, route
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.tools import find_router, from_rtlil, pack
from boresight.gateware.texts.core import render
from boresight.model.errors import require_choice
from boresight.model.tools.external import ToolFailed, optional


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
        resource, dot, part = position.partition(".")
        if not dot:
            return Pins(position, dir=direction, conn=self.connector)
        (pins,) = (sub.ios[0] for sub in platform.lookup(resource).ios if sub.name == part)
        return Pins(" ".join(pins.names), dir=direction)

    def where(self, line: Line) -> tuple[str, str]:
        """Position on the connector, and meaning: without the adapter that the board itself has."""
        places = {**self.positions, **{f"led{k}": led for k, led in enumerate(self.leds)}}
        position = places.get(line.place)
        if position is not None and "." not in position:
            return f"{self.header} position {position}", line.meaning
        is_led = line.place.startswith("led")
        return "on the board", line.meaning if is_led else line.meaning.partition(":")[0]

    @property
    def header(self) -> str:
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
    return {name: str(k) for k, name in enumerate(names.split(), first)}


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


#: First line of the build plan's files, instead of the names and versions of tools.
NOTICE = "Generated by Boresight. Do not edit."


class Design(Protocol):
    """Design of a project: a component whose ports are ``lines``."""

    lines: tuple[Line, ...]
    clock_hz: float
    title: str

    #: Template of README.txt (`gateware.texts`), which extends ``board.txt``.
    readme: str

    def facts(self) -> dict[str, Any]:
        """Values of the design for the template."""


class Shell(Elaboratable):
    """A design on the pins of a board, with its clock."""

    def __init__(self, design: Design, board: Board, clock: Clock | None) -> None:
        self.design, self.board, self.clock = design, board, clock

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        if self.clock is not None:
            m.domains.sync = ClockDomain(reset_less=self.clock.reset_less)
            m.submodules.clock = self.clock
        m.submodules.design = self.design
        for line in self.design.lines:
            port = getattr(self.design, line.name)
            led = line.place.removeprefix("led")
            is_led = led != line.place
            pin = platform.request("led", int(led)) if is_led else platform.request(line.name, 0)
            m.d.comb += port.eq(pin.i) if line.input else pin.o.eq(port)
        for number in range(len(self.board.high_parts)):
            m.d.comb += platform.request("held", number).o.eq(1)
        return m


def _stripped(text: str) -> str:
    """Text of a build plan's file without names and versions of tools."""
    first, _, rest = text.partition("\n")
    mark, generated, _ = first.partition("Automatically generated by Amaranth")
    if generated:
        first = mark + NOTICE + (" */" if mark.startswith("/*") else "")
    return f"{first}\n{rest}".rstrip("\n") + "\n"


def _pin_table(design: Design, board: Board, places: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Signal, pin, place and meaning of every net; ``places`` are the pins by net."""
    known = {
        f"{'led_' + line.place[3:] if line.place.startswith('led') else line.name + '_0'}__io": (
            line.name,
            *board.where(line),
        )
        for line in design.lines
    }
    for k, part in enumerate(board.high_parts):
        known[f"held_{k}__io"] = part, "on the board", "driven high"
    clock = "clock", "on the board", f"oscillator, {board.oscillator_hz / 1e6:g} MHz"
    rows: list[tuple[str, ...]] = [("signal", "FPGA pin", "where", "meaning")]
    for net, pin in places.items():
        name, where, meaning = known.get(net, clock)
        rows.append((name, pin, where, meaning))
    return rows


class ClockMissed(ToolFailed):
    """No placement reaches the clock of the design."""


@dataclass(frozen=True)
class Project:
    """A design on a board, as Amaranth's build plan has it."""

    design: Design
    board: Board
    clock_hz: int
    platform: Any
    #: Files of the plan by name, without paths, dates and versions of tools; ``top.v`` has module
    #: ``top`` with the primitives of the part's pads and PLL.
    texts: Mapping[str, str]

    def readme(self, **flow: Any) -> str:
        """README.txt; ``flow``: of an open flow router, routed design and its fastest run."""
        platform = self.platform
        places = {name: pin for name, pin, _ in platform.iter_port_constraints_bits()}
        return render(
            self.design.readme,
            **self.design.facts(),
            **{"routed": None, **flow},
            title=f"{self.design.title} on {self.board.title}",
            part=f"{platform.device}-{getattr(platform, 'speed', '')}{platform.package}",
            clock=self.clock_hz,
            oscillator=self.board.oscillator_hz,
            connector=self.board.header,
            pins=_pin_table(self.design, self.board, places),
        )


def prepared(make: Callable[[int], Design], board: str, *, clock_hz: int | None = None) -> Project:
    """A design on a board; arguments and errors as of `write_project`."""
    require_choice("board", board, BOARDS)
    chosen = BOARDS[board]
    hz = chosen.oscillator_hz if clock_hz is None else clock_hz
    clock = chosen.clocking.of(chosen.oscillator_hz, hz)
    design = make(hz)
    platform = chosen.make(design.lines)
    options: dict[str, Any] = {}
    if TARGETS[chosen.target].family.router is None:
        # Asynchronous inputs end in synchronisers, so paths from their pads have no timing.
        inputs = (line.name for line in design.lines if line.input)
        untimed = "\n".join(f'NET "{name}_0__io" TIG;' for name in inputs)
        options = {"add_constraints": untimed, "map_opts": ["-ol high"], "par_opts": ["-ol high"]}
    # Variables of Amaranth would change the plan.
    kept = {name: text for name, text in os.environ.items() if not name.startswith("AMARANTH_")}
    with mock.patch.dict(os.environ, kept, clear=True):
        plan = platform.prepare(Shell(design, chosen, clock), "top", emit_src=False, **options)
    files = plan.files.items()
    texts = {name: text.decode() if isinstance(text, bytes) else text for name, text in files}
    verilog = from_rtlil(texts.pop("top.il"), "top")
    clean = {name: _stripped(text) for name, text in texts.items()}
    clean["top.v"] = f"/* {NOTICE} */\n{verilog}"
    return Project(design, chosen, hz, platform, clean)


def write_project(
    make: Callable[[int], Design],
    board: str,
    folder: Path,
    *,
    clock_hz: int | None = None,
    seeds: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Routed | None:
    """Write a design on a board: an ISE project, or the bitstream of the fastest placement.

    Returns the design as routed, if it is. The same design gives the same files. ``make`` returns
    the design for a clock in Hz: that of the board's oscillator, or ``clock_hz``, made by a PLL.
    ``seeds`` is the number of placements. Raises InputError for an unknown board, a clock that the
    PLL cannot make or too small a part, ToolMissing, SynthesisError or RouteError if a tool
    rejected the design, ClockMissed if the fastest placement is slower than that clock.
    """
    project = prepared(make, board, clock_hz=clock_hz)
    target = TARGETS[project.board.target]
    router, routed, files = target.family.router, None, dict[str, str | bytes]()
    if router is None:
        files |= {name: text for name, text in project.texts.items() if name != "build_top.json"}
        files |= {name: render(name) for name in ("build.sh", "build.bat")}
        files["README.txt"] = project.readme()
    else:
        find_router(router)  # before the work
        verilog, pins = project.texts["top.v"], project.texts[router.pins[1]]
        mapped = netlist_for(verilog, "top", target)
        (option, placed), mhz = router.placed, project.clock_hz / 1e6
        constraints = {router.pins[0]: (router.pins[1], pins)}
        options = {"constraints": constraints, "writes": {option: placed}}
        routed = route(mapped, mapped.netlist, mhz, seeds, progress=progress, **options)
        best = max(routed.runs, key=lambda run: run.clock_mhz or 0.0)
        if (found := best.clock_mhz or 0.0) < mhz:
            raise ClockMissed(
                f"clock: wanted {mhz:g} MHz, found {found:.1f} MHz at best, {routed.seeds} "
                f"({routed.version}): ask for a slower --clock, more --seeds or a deeper --config"
            )
        readme = project.readme(routed=routed, best=best, router=router)
        files |= {"top.v": verilog, router.pins[1]: pins, "README.txt": readme}
        files[router.bitstream] = pack(router, placed, best.files[placed])
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        if isinstance(content, str):
            end = "\r\n" if name.endswith(".bat") else "\n"
            content = content.replace("\n", end).encode()
        (folder / name).write_bytes(content)
        if name.endswith(".sh"):
            (folder / name).chmod(0o755)
    return routed
