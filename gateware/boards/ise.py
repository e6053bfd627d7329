"""ISE 14.7 projects: a design on a board, ready to build."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from boresight.gateware.boards.project import Design, prepared
from boresight.gateware.texts.render import render


def write_ise_project(
    make: Callable[[int], Design], board: str, folder: Path | str, *, clock_hz: int | None = None
) -> tuple[Path, ...]:
    """Write an ISE project of a design on a board.

    The project is built with ISE 14.7 by ``build.sh`` (``build.bat``), as ``README.txt`` explains.
    The same design gives the same files.

    Parameters
    ----------
    make : callable
        Function that returns the design for a clock in Hz.
    board : str
        One of `BOARDS` with a Spartan-6.
    folder : Path
        Output folder; made if it is missing.
    clock_hz : int, optional
        Clock of the design; that of the board's oscillator by default, else made by a PLL.

    Returns
    -------
    tuple of Path
        The files, sorted.

    Raises
    ------
    InputError
        Unknown board, or a clock that the PLL cannot make.
    """
    project = prepared(
        make,
        board,
        clock_hz=clock_hz,
        # Asynchronous inputs end in synchronisers, so paths from their pads have no timing.
        options=lambda design: {
            "add_constraints": "\n".join(
                f'NET "{line.name}_0__io" TIG;' for line in design.lines if line.input
            ),
            "map_opts": ["-ol high"],
            "par_opts": ["-ol high"],
        },
    )
    written = {name: text for name, text in project.texts.items() if name != "build_top.json"}
    written["build.sh"] = render("build.sh")
    written["build.bat"] = render("build.bat")
    written["README.txt"] = project.readme(bitstream=None)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in written.items():
        end = "\r\n" if name.endswith(".bat") else "\n"
        (folder / name).write_text(text, encoding="utf-8", newline=end)
        if name.endswith(".sh"):
            (folder / name).chmod(0o755)
    return tuple(folder / name for name in sorted(written))
