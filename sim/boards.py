"""Complete systems on boards, by entry point: sensors at the pins, a serial line to a computer.

An installed package offers its system as an entry point of the group ``boresight.boards``, a class
derived from `BoardSystem`. `boresight compile --board`, `run`, `fit` and `monitor` use it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.description import Description
from boresight.model.estimator import Estimator
from boresight.model.resolve import load, names_of_entry_points
from boresight.sim.records.feed import RATE_TOLERANCE

#: Entry points of installed packages that are complete systems.
BOARD_GROUP = "boresight.boards"


class BoardSystem:
    """A complete system around a core, in gateware, in simulation and on a board."""

    #: Names of the files that `simulate` writes.
    files: tuple[str, ...]
    #: Estimators that the system adds to every core.
    programs: tuple[type[Estimator], ...] = ()
    #: Updates per second with the sensors' default settings, on the board and in `simulate`.
    rate_hz: float
    #: (estimators, *, config, word, clock_hz, params): A core with these and `programs`.
    core: Callable[..., Core]
    #: (core, clock_hz): The Amaranth component of the complete system, and its register map.
    design: Callable[..., tuple[Any, Description]]
    #: (folder, name, log, *, config, params, seconds, source, feed, say): Simulates the complete
    #: system from pins to frames; writes `files` into a folder.
    simulate: Callable[..., Any]
    #: (name, *, progress): Simulates faults of the sensors, each in a simulation of its own.
    simulate_faults: Callable[..., Any]
    #: (sources, settings, output): Fits the sensors' registers to records, and writes them as a
    #: file of parameters.
    calibrate: Callable[..., Any]
    #: (source, **options): Reads frames and registers from a serial port, or frames from a file.
    monitor: Callable[..., Any]

    def rate_notes(self, estimators: Iterable[Estimator]) -> list[str]:
        """Warnings about estimators whose gains are designed for another rate than the board's."""
        return [
            f"{e.name}: its rates_hz says {e.rates_hz['dt']:g} samples a second, and the board "
            f"updates it {self.rate_hz:g} times a second: design its gains for that rate"
            for e in estimators
            if abs(self.rate_hz / e.rates_hz.get("dt", self.rate_hz) - 1.0) > RATE_TOLERANCE
        ]


def board_system() -> BoardSystem:
    """The complete system that is installed, of several the first by name; InputError if none."""
    names = names_of_entry_points(BOARD_GROUP)
    return load(names[0] if names else "none", BoardSystem, "board", BOARD_GROUP)
