"""Complete systems on boards, by entry point: sensors at the pins, a serial line to a computer.

An installed package offers its system as an entry point of the group ``boresight.boards``, a class
derived from `BoardSystem`. `boresight compile --board`, `run`, `fit` and `monitor` use it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.description import Description
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, load, names_of_entry_points

#: Entry points of installed packages that are complete systems.
BOARD_GROUP = "boresight.boards"


class BoardSystem:
    """A complete system around a core, in gateware, in simulation and on a board.

    Attributes
    ----------
    files : tuple of str
        Names of the files that `simulate` writes.
    programs : tuple of types
        Estimators that the system adds to every core.
    """

    files: tuple[str, ...]
    programs: tuple[type[Estimator], ...] = ()

    def core(
        self,
        estimators: Sequence[Named],
        *,
        config: str,
        word: int,
        clock_hz: int,
        params: Mapping[str, Mapping[str, float]],
    ) -> Core:
        """Return a core with these estimators and the programs that the system adds."""
        raise NotImplementedError

    def design(self, core: Core, clock_hz: int) -> tuple[Any, Description]:
        """Return the Amaranth component of the complete system, and its register map."""
        raise NotImplementedError

    def simulate(
        self,
        folder: Path,
        name: Named | None,
        log: Any,
        *,
        config: str,
        params: Mapping[str, Mapping[str, float]],
        seconds: float,
        source: str,
        feed: Mapping[str, float] | None,
        say: Callable[[str], None],
    ) -> Any:
        """Simulate the complete system from pins to frames; write `files` into a folder."""
        raise NotImplementedError

    def simulate_faults(self, name: str | None, *, progress: Callable[[str], None] | None) -> Any:
        """Simulate faults of the sensors, each in a simulation of its own."""
        raise NotImplementedError

    def calibrate(
        self, sources: Sequence[Any], settings: Mapping[str, Any], output: str | Path
    ) -> Any:
        """Fit the sensors' registers to records, and write them as a file of parameters."""
        raise NotImplementedError

    def monitor(self, source: str, **options: Any) -> Any:
        """Read frames and registers from a serial port, or frames from a captured file."""
        raise NotImplementedError


def board_system() -> BoardSystem:
    """Return the complete system that is installed; of several, the first by name.

    Raises
    ------
    InputError
        No package offers one.
    """
    names = names_of_entry_points(BOARD_GROUP)
    return load(names[0] if names else "none", BoardSystem, "board", BOARD_GROUP)
