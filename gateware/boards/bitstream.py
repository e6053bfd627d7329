"""A design on a board with an open flow: Verilog, pins, and the bitstream by yosys and nextpnr."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from boresight.gateware.boards.project import Project
from boresight.gateware.synthesis.nextpnr import find_router, pack
from boresight.gateware.synthesis.routed import Routed, netlist_for, route
from boresight.model.tools.failure import ToolFailed


class ClockMissed(ToolFailed):
    """No placement reaches the clock of the design."""


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


def build_bitstream(
    project: Project, *, seeds: int = 1, progress: Callable[[str], None] = lambda text: None
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
    target, router = project.target, project.router
    clock_mhz = project.clock_hz / 1e6
    find_router(router)  # before the work
    mapped = netlist_for(project.verilog, "top", target)
    option, placed = router.placed
    routed = route(
        mapped,
        mapped.netlist,
        clock_mhz,
        seeds,
        progress=progress,
        constraints={router.pins[0]: (router.pins[1], project.pins)},
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


def write_open_project(folder: Path, project: Project, built: Bitstream) -> None:
    """Write ``top.v``, the pins, the bitstream and README.txt."""
    router = project.router
    texts: Mapping[str, str] = {
        "top.v": project.verilog,
        router.pins[1]: project.pins,
        "README.txt": project.readme(bitstream=built, router=router),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    (folder / router.bitstream).write_bytes(built.data)
