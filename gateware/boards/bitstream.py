"""A design on a board with an open flow: Verilog, pins, and the bitstream by yosys and nextpnr."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from boresight.gateware.boards.project import Design, Project, board_named, prepared
from boresight.gateware.synthesis.family import Router, Target
from boresight.gateware.synthesis.nextpnr import find_router, pack
from boresight.gateware.synthesis.routed import Routed, netlist_for, route
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.tools.failure import ToolFailed


class ClockMissed(ToolFailed):
    """No placement reaches the clock of the design."""


@dataclass(frozen=True)
class OpenProject:
    """A design on a board whose part an open tool routes.

    Attributes
    ----------
    project : Project
    target : Target
        The board's part.
    verilog : str
        Module ``top``, with the primitives of the part's pads and PLL.
    pins : str
        Pins and the oscillator's period, in the format of the router.
    """

    project: Project
    target: Target
    verilog: str
    pins: str

    @property
    def router(self) -> Router:
        """The part's router."""
        router = self.target.family.router
        assert router is not None
        return router


@dataclass(frozen=True)
class Bitstream:
    """A placed and routed design, packed.

    Attributes
    ----------
    routed : Routed
        All seeds.
    seed : int
        Seed of the bitstream, the fastest one.
    data : bytes
    """

    routed: Routed
    seed: int
    data: bytes

    @property
    def clock_mhz(self) -> float:
        """Clock of its placement."""
        return max(run.clock_mhz or 0.0 for run in self.routed.runs)


def open_project(
    make: Callable[[int], Design], board: str, *, clock_hz: int | None = None
) -> OpenProject:
    """A design on a board; no router is needed.

    Parameters
    ----------
    make : callable
        Function that returns the design for a clock in Hz.
    board : str
        One of `BOARDS` with a part of an open flow.
    clock_hz : int, optional
        Clock of the design; that of the board's oscillator by default, else made by a PLL.

    Raises
    ------
    InputError
        Unknown board, or a clock that the PLL cannot make.
    ToolMissing
        Yosys is not installed.
    """
    chosen = board_named(board)
    target = TARGETS[chosen.target]
    project = prepared(make, chosen, clock_hz=clock_hz)
    router = target.family.router
    assert router is not None
    return OpenProject(project, target, project.texts["top.v"], project.texts[router.pins[1]])


def build_bitstream(
    design: OpenProject, *, seeds: int = 1, progress: Callable[[str], None] = lambda text: None
) -> Bitstream:
    """Synthesise, place and route with seeds 1, 2, ..., pack the fastest placement.

    Raises
    ------
    ToolMissing
        Yosys, router or packer is not installed.
    InputError
        The part is too small.
    SynthesisError, RouteError
        A tool rejected the design.
    ClockMissed
        The fastest placement is slower than the clock of the design.
    """
    target, router = design.target, design.router
    clock_mhz = design.project.clock_hz / 1e6
    find_router(router)  # before the work
    mapped = netlist_for(design.verilog, "top", target)
    option, placed = router.placed
    routed = route(
        mapped,
        mapped.netlist,
        clock_mhz,
        seeds,
        progress=progress,
        constraints={router.pins[0]: (router.pins[1], design.pins)},
        writes={option: placed},
    )
    best = max(routed.runs, key=lambda run: run.clock_mhz or 0.0)
    if (best.clock_mhz or 0.0) < clock_mhz:
        raise ClockMissed(
            f"clock: wanted {clock_mhz:g} MHz, found {best.clock_mhz or 0.0:.1f} MHz at best, "
            f"{routed.seeds} ({routed.version}): ask for a slower --clock, more --seeds or a "
            "greater --depth"
        )
    return Bitstream(routed, best.seed, pack(router, placed, best.files[placed]))


def write_open_project(folder: Path, design: OpenProject, built: Bitstream) -> None:
    """Write ``top.v``, the pins, the bitstream and README.txt."""
    project, router = design.project, design.router
    places = {name: pin for name, pin, _ in project.platform.iter_port_constraints_bits()}
    texts: Mapping[str, str] = {
        "top.v": design.verilog,
        router.pins[1]: design.pins,
        "README.txt": project.readme(places, bitstream=built, router=router),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    (folder / router.bitstream).write_bytes(built.data)
