"""Write Verilog, ISE project, microcode, register map, C, report.json.

boresight compile my_filter.py -o build  # a filter of one's own
boresight compile complementary mekf -o build  # two in one core; a register says which runs
boresight compile mekf --config fast --board mimas --synth -o build  # ISE project, estimates
boresight compile mekf my_filter.py --config small-1024 -o build  # twice the registers
boresight compile my_filter.py --target generic --axi -o build  # for any part; behind AXI
boresight compile my_filter.py --target ecp5-25k --route --seeds 5 -o build  # placed and routed
boresight compile mekf --board ulx3s --clock 100 -o build  # to the bitstream, with open tools
boresight compile my_filter.py --target ecp5-25k --depth 7 -o build  # not the fastest depth there
boresight compile "vqf(rate_hz=200, mag='none')" -o build  # one that takes arguments
boresight compile complementary --urgent 3 -o build  # the first three outputs soonest
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from boresight.arguments import (
    check_machine,
    check_number,
    check_routable,
    check_target,
    check_urgent,
)
from boresight.core_files import (
    SYSTEM_CLOCK_HZ,
    TARGET_NAMES,
    core_files,
    core_texts,
    is_open,
    map_core,
    project_files,
    project_folder,
    route_core,
    together,
    write_core,
    write_project,
    write_system,
    write_text,
)
from boresight.depths import depth_by_time
from boresight.gateware.boards.board import BOARDS
from boresight.gateware.boards.top import records_design
from boresight.gateware.machine import ALL_CONFIGS, at_depth
from boresight.gateware.synthesis.blocks import check_memory
from boresight.gateware.synthesis.routed import Mapped, Routed, netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.verilog import to_verilog
from boresight.model.errors import InputError, require_choice
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.cache import Cache
from boresight.model.tools.files import output_folder
from boresight.options import Config, EstimatorNames, OutputFolder, Params, Urgent, Word
from boresight.regression import JudgedVerb
from boresight.results.compile import CompiledProgram, CompileResult, Proven, TargetFigures
from boresight.sharing import estimator_names, params_of_each
from boresight.sim.answer import JsonObject, plain
from boresight.sim.boards import board_system
from boresight.sim.compare.soundness import check_sound
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.report.data import report_data

__all__ = ["compile"]

#: What an ISE project can be made of.
TOPS = ("sensors", "records")


def compile(
    name: EstimatorNames,
    *others: EstimatorNames,
    config: Config = "small",
    board: str | None = None,
    word: Word = 32,
    synth: bool = False,
    output: OutputFolder = "build",
    params: Params = None,
    urgent: Urgent = None,
    top: str = "sensors",
    target: str | None = None,
    depth: int | None = None,
    axi: bool = False,
    route: bool = False,
    seeds: int = 1,
    clock: float | None = None,
    rate: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> CompileResult:
    """Compile one estimator or several into a core, and write everything about it.

    With several estimators the core holds them all, a register says which runs, and the files of a
    single program have its name in theirs: ``microcode-mekf.lst``.

    Parameters
    ----------
    name : str, class or Estimator
        Name, FILE.py:CLASS, class or object.
    others : str, class or Estimator
        More of them: one core holds them all, in this order, and a register says which runs.
    board : str, optional
        Also write an ISE project for this board, mimas or sk-xc6slx9; or with open tools the
        bitstream for ulx3s or icebreaker.
    top : str
        What that is: sensors, the complete system of readers, calibration, filters and
        output, or records, the core alone, fed by the host.
    synth : bool
        Also synthesise (yosys): area and clock estimate of the core, and of the complete system if
        there is one (``system`` in the report). Area alone where the target is no Spartan-6.
    target : str, optional
        What ``core.v`` is for: xc6slx9 (or another Spartan-6), with its primitives, or without any
        generic, ecp5-25k, ice40-up5k, ... (docs/targets.md); by default the board's part, or
        xc6slx9.
    depth : int, optional
        Depth of the pipeline, 7, 9, 10 or 12; by default the one with the shortest time to the last
        urgent output on the target, or 7 where no clocks were routed.
    route : bool
        Also place and route the core on the target (nextpnr), between flip-flops: area and clock.
    seeds : int
        Placements that are tried, with seeds 1, 2, ...; the slowest counts.
    clock : float, optional
        Clock in MHz: fails where the routed core, at its slowest seed, does not reach it. On a
        board with open tools the clock of the design, 100 by default (of records the oscillator's):
        fails where no seed reaches it.
    axi : bool
        Also the core behind AXI4-Stream and AXI4-Lite, ``core_axi.v``.
    params : mapping
        Values other than the defaults; of several estimators such a mapping of each by its name.
    rate : float, optional
        Records a second, Hz: fails where the core at 100 MHz is not done in time.

    Returns
    -------
    CompileResult
        Latencies by output, area and clock; ``report`` is the contents of report.json.

    Raises
    ------
    InputError
        Unknown or repeated name, illegal width or parameter, folder that cannot be written, or
        what no core could compute right (`sim.compare.soundness`).
    ScheduleError
        The programs do not fit into one core.
    """
    say = progress or (lambda text: None)
    names = estimator_names(name, *others)
    estimators = [find_estimator(n) for n in names]
    own = [e.name for e in estimators]
    chosen_by_us = depth is None and config in ALL_CONFIGS
    config = at_depth(config, depth)
    check_machine(config, word)
    check_urgent(urgent, estimators)
    if rate is not None:
        check_number("rate", int(rate) if math.isfinite(rate) else -1, 1, SYSTEM_CLOCK_HZ)
    chosen = params_of_each(names, params)
    with_config = partial(Build, *estimators, word=word, params=chosen, urgent=urgent)
    build = with_config(config=config)
    target = _target(target, board)
    _check_project(board, top)
    _check_route(target, route=route or is_open(board), seeds=seeds, clock=clock)
    expected = core_files(own, target=target, axi=axi)
    if board is not None:
        expected += project_files(board, system=top == "sensors")
    check_sound(build)
    with output_folder(output, "compile", files=expected) as folder:
        choice = None
        if chosen_by_us and target in TARGETS:
            choice = depth_by_time(build, TARGETS[target])
        if choice is not None:
            say(str(choice))
            build = with_config(config=choice.config)
        core = build.core
        if target in TARGETS:
            check_memory(core.machine, core.image, TARGETS[target])
        area: Mapped | Routed | None = None
        part = TARGETS.get(target, TARGETS[TARGET_NAMES[0]])
        if route:
            say(f"synthesis (yosys), then {part.title}")
            area = route_core(core, part, seeds=seeds, clock_mhz=clock, progress=say)
        elif synth:
            say(f"synthesis (yosys) for {part.title}")
            area = map_core(core, part)
        say(f"{', '.join(own)} for {build.config}: Verilog")
        texts = core_texts(build, recorded(build), area=area, target=target, axi=axi)
        proven = write_core(folder, core, texts)
        whole: TargetFigures | None = None
        if board is not None:
            say(f"{board}: {top}")
            place = folder / project_folder(board)
            settings: Mapping[str, Any] = {"seeds": seeds, "progress": say}
            hz = None if clock is None or not is_open(board) else round(1e6 * clock)
            if top == "records":
                on_board = write_project(
                    records_design(core), board, place, clock_hz=hz, **settings
                )
                whole = None if on_board is None else TargetFigures.of(on_board)
            else:
                whole = _write_sensors(place, board, build, hz, synth=synth, settings=settings)
        data = together(
            core,
            [
                report_data(core.select(k), area=area, device=part.device, grade=part.grade)
                for k in range(len(own))
            ],
        )
        if choice is not None:
            data["depth"] = plain(choice)
        if whole is not None:
            data["system"] = plain(whole)
        write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
    result = _result(Path(output), build, proven, area, whole, data, rate)
    return replace(result, clock_mhz=clock, depth=choice)


def _result(
    output: Path,
    build: Build,
    proven: Proven,
    area: Mapped | Routed | None,
    whole: TargetFigures | None,
    data: JsonObject,
    rate: float | None,
) -> CompileResult:
    """What was compiled."""
    core = build.core
    return CompileResult(
        output=output,
        config=core.machine.name,
        word=core.machine.arithmetic.word,
        digest=core.digest,
        programs=tuple(
            CompiledProgram(
                part.program.name,
                dict(zip(part.program.output_names, part.schedule.latencies, strict=True)),
                part.schedule.interval,
                str(estimator.profile or ""),
            )
            for part, estimator in zip(core.parts, build.estimators, strict=True)
        ),
        proven=proven,
        core=None if area is None else TargetFigures.of(area),
        system=whole,
        report=data,
        rate_hz=rate,
    )


def _target(target: str | None, board: str | None) -> str:
    """The target: as said, or the board's part, or the default."""
    part = TARGET_NAMES[0]
    if board is not None:
        require_choice("board", board, BOARDS)
        part = BOARDS[board].target
    if target is None:
        return part
    check_target(target, TARGET_NAMES)
    if board is not None and target != part:
        raise InputError.at(
            "target",
            wanted=f"{part}, the part of {board}",
            found=target,
            fix="leave out --board or --target",
        )
    return target


def _check_route(target: str, *, route: bool, seeds: int, clock: float | None) -> None:
    """Raise InputError, or ToolMissing, unless a core can be routed on a target."""
    check_number("seeds", seeds, 1, 1000)
    if clock is not None:
        check_number("clock", int(clock) if math.isfinite(clock) else -1, 1, 1000)
    if route:
        check_routable([target], "--synth")
        router = TARGETS[target].family.router
        if clock is not None and router is not None and router.untimed:
            raise InputError.at(
                "clock",
                wanted=f"a target whose multipliers {router.program} has delays of",
                found=f"--target {target}",
                fix="leave --clock out, or choose another target",
            )
    if not route and (clock is not None or seeds > 1):
        raise InputError.at(
            "clock" if clock is not None else "seeds",
            wanted="a design that is routed",
            found="no --route",
            fix="add --route and a target such as ecp5-25k, or --board ulx3s",
        )


def _check_project(board: str | None, top: str) -> None:
    """Raise InputError unless such a project can be made."""
    require_choice("top", top, TOPS)
    if board is not None and top == "sensors" and not BOARDS[board].holds_system:
        raise InputError.at(
            "board",
            wanted="a part that holds the complete system with its sensors",
            found=f"{BOARDS[board].target} of {board}",
            fix="add --top records: a computer sends the records",
        )


def _write_sensors(
    folder: Path,
    board: str,
    build: Build,
    clock_hz: int | None,
    *,
    synth: bool,
    settings: Mapping[str, Any],
) -> TargetFigures | None:
    """Write the project of the complete system; its figures, if it is routed or synthesised."""
    values = {e.name: v for e, v in zip(build.estimators, build.params, strict=True) if v}
    hz = clock_hz or SYSTEM_CLOCK_HZ
    core = board_system().core(
        build.estimators, config=build.config, word=build.word, clock_hz=hz, params=values
    )
    system, routed = write_system(folder, board, core, clock_hz=hz, **settings)
    if routed is not None:
        return TargetFigures.of(routed)
    if not synth:
        return None
    settings["progress"]("synthesis of the complete system")
    text = to_verilog(system, "system", instances=True)
    target = TARGETS[BOARDS[board].target]
    return TargetFigures.of(netlist_for(text, "system", target, cache_dir=Cache().root))


VERB = JudgedVerb(compile, judged=CompileResult.judged)
