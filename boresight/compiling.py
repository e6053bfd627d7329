"""`boresight compile`: Verilog, ISE project, microcode, register map, C, report.json."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from boresight.output import output_folder
from firmware.emit import emit_c
from gateware.boards.ise import BOARDS, write_ise_project
from gateware.core import Core, build_core
from gateware.register_header import to_header
from gateware.register_map import register_map
from gateware.register_page import to_markdown
from gateware.register_svd import to_svd
from gateware.synthesis.estimate import Estimate, estimate
from model.errors import InputError
from model.estimators import estimator as find_estimator
from sim.check import with_params
from sim.report_data import report_data

__all__ = ["check_board", "compile", "core_for", "estimate_core"]


def check_board(board: str | None) -> None:
    """Raise InputError unless ``board`` is None or known."""
    if board is not None and board not in BOARDS:
        raise InputError.at("board", wanted=f"one of {', '.join(BOARDS)}", found=repr(board),
                            fix="choose one of these, or leave --board out")


def core_for(name: str, *, config: str = "small", word: int = 32,
             params: Mapping[str, float] | None = None, urgent: int | None = None) -> Core:
    """Compile an estimator to a core."""
    estimator = find_estimator(name)
    program = with_params(estimator.compile(word=word), estimator, params)
    return build_core(program, config, urgent=estimator.urgent if urgent is None else urgent)


def estimate_core(core: Core) -> Estimate:
    """Area and clock estimate of a core (yosys and our timing analysis)."""
    return estimate(core.verilog(instances=True), "core")


def compile(name: str, *, config: str = "small", board: str | None = None, word: int = 32,
            synth: bool = False, output: str | Path = "build",
            params: Mapping[str, float] | None = None, urgent: int | None = None,
            progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Compile an estimator and write everything about it.

    Parameters
    ----------
    name : str
        Estimator.
    config : str
        "small" or "fast".
    board : str, optional
        Also write the ISE project for this board.
    word : int
        Word width, 18 to 32.
    synth : bool
        Also synthesise: area and clock estimate.
    output : path
        Folder for the files.
    params : mapping, optional
        Parameter values other than the defaults.
    urgent : int, optional
        Leading outputs whose latency counts first.

    Returns
    -------
    dict
        The contents of report.json.

    Raises
    ------
    InputError
        Unknown name, illegal width or parameter, folder that cannot be written.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    check_board(board)
    with output_folder(Path(output)) as folder:
        start = time.perf_counter()
        core = core_for(name, config=config, word=word, params=params, urgent=urgent)
        say(f"{name} for {config}: Verilog")
        verilog = core.verilog(instances=True)
        seconds = time.perf_counter() - start
        (folder / "core.v").write_text(verilog)
        (folder / "core_sim.v").write_text(core.verilog(instances=False))
        (folder / "microcode.lst").write_text(core.listing)
        (folder / "program.json").write_text(core.program.to_json() + "\n")
        (folder / "schedule.json").write_text(core.schedule.to_json() + "\n")
        registers = register_map(core, meanings={p.name: p.meaning for p in estimator.params})
        (folder / "registers.json").write_text(registers.to_json())
        (folder / "registers.svd").write_text(to_svd(registers))
        (folder / "registers.h").write_text(to_header(registers))
        (folder / "registers.md").write_text(to_markdown(registers))
        (folder / "firmware").mkdir()
        for file, text in emit_c(core.program).items():
            (folder / "firmware" / file).write_text(text)
        if board is not None:
            say(f"ISE project for {board}")
            write_ise_project(core, board, folder / f"ise-{board}")
        area = None
        if synth:
            say("synthesis (yosys) and clock estimate")
            area = estimate_core(core)
        data = report_data(core, estimator, area=area)
        data["compile_seconds"] = round(seconds, 2)
        (folder / "report.json").write_text(json.dumps(data, indent=1) + "\n")
    return data
