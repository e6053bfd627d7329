"""Write a core for an FPGA: Verilog, test bench, instances, register map, C.

boresight compile my_filter.py -o build  # your own filter
boresight compile complementary mekf -o build  # two in one core; a register selects one
boresight compile mekf --config fast --board mimas --synth -o build  # ISE project, area, clock
boresight compile my_filter.py --target generic -o build  # Verilog for any part
boresight compile my_filter.py --target ecp5-25k --route --seeds 5 -o build  # placed and routed
boresight compile mekf --board ulx3s --clock 100 -o build  # a bitstream, with open tools
boresight compile my_filter.py --target ecp5-25k --config small-d7 -o build  # depth of your choice
boresight compile "vqf(rate_hz=200, mag='none')" -o build  # arguments of the constructor
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from boresight import options
from boresight.builds import build_for, made_of
from boresight.firmware.emit import check_together, emit_c
from boresight.firmware.layout import stem
from boresight.gateware.boards.board import BOARDS, write_project
from boresight.gateware.boards.top import records_design
from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.machine import machine_named
from boresight.gateware.microcode.image import check_memories
from boresight.gateware.synthesis.family import Router
from boresight.gateware.synthesis.routed import Mapped, Routed, check_memory, netlist_for
from boresight.gateware.synthesis.targets import SPARTAN6, TARGETS
from boresight.gateware.synthesis.tools import find_router, to_verilog
from boresight.gateware.texts import core as templates
from boresight.gateware.texts.core import Recorded
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import output_folder
from boresight.model.words.fixed import check_word
from boresight.sim.boards import board_system
from boresight.sim.compare.results import unproven
from boresight.sim.compare.twin import Traced, check_sound
from boresight.sim.explore.measure import map_core, route_core
from boresight.sim.levels.build import Build
from boresight.sim.levels.rtl import recorded
from boresight.sim.report.data import JUDGED, core_data
from boresight.sim.result import Result, Row, plain

GROUPS = (options.profiles, options.tolerances, options.judged)

#: Targets of ``core.v``; the first by default.
TARGET_NAMES = ("xc6slx9", "generic", *(name for name in TARGETS if name != "xc6slx9"))

#: Clocks of complete systems, Hz: one that is routed; that of the simulated board, which the
#: estimate for Spartan-6 with slow nets meets.
ROUTED_CLOCK_HZ, SYSTEM_CLOCK_HZ = 100_000_000, 70_000_000
#: What a board's project can be made of.
TOPS = ("sensors", "records")
#: Clock for which times are given where none was asked for or routed.
_CLOCK_MHZ = 100.0


def compile(
    estimator: options.EstimatorNames,
    /,
    *others: options.EstimatorNames,
    config: options.Config = "small",
    word: options.Word = 32,
    target: str | None = None,
    board: str | None = None,
    top: str = "sensors",
    synth: bool = False,
    route: bool = False,
    seeds: int = 1,
    clock: float | None = None,
    params: options.Params = None,
    output: options.OutputFolder = "build",
    progress: options.Progress = None,
) -> Result:
    """Compile one or several estimators into a core, and write its files.

    Several estimators share the core, in this order; a register selects the one that runs.

    Returns the contents of report.json: ``timing`` with latencies and interval, ``resources``; for
    several estimators also ``programs``, the report of each. Raises InputError for an unknown or
    repeated name, an illegal width or parameter, a folder that cannot be written, and a format that
    is too coarse (`sim.compare.twin`); ScheduleError if the programs do not fit into one core.

    Parameters
    ----------
    target : str, optional
        Part that core.v is for: xc6slx9 (or another Spartan-6), with its primitives, or generic,
        ecp5-25k, ice40-up5k, ... (docs/targets.md), without primitives. By default the board's
        part, or xc6slx9. If --config names no depth, the fastest one for the part is used.
    board : str, optional
        Also write a project for this board: mimas or sk-xc6slx9 (ISE), ulx3s or icebreaker (the
        bitstream, with open tools).
    top : str
        Project for the board: sensors, the complete system, or records, a core that is fed by a
        computer.
    synth : bool
        Also synthesise the core, and the complete system of a board: area, and on Spartan-6 an
        estimate of the clock.
    route : bool
        Also place and route the core on the target: area and clock.
    seeds : int
        Number of placements; the slowest one is the result.
    clock : float, optional
        Clock in MHz; on a board, that of the design. The command fails if the slowest placement
        does not reach it.
    params : mapping, optional
        Parameter values; for several estimators a mapping of each by its name.
    """
    say = progress or (lambda text: None)
    names = options.estimator_names(estimator, *others)
    estimators = [find_estimator(n) for n in names]
    own = [e.name for e in estimators]
    machine_named(config.removesuffix("-d7"))
    check_word(word)
    system = board_system() if board is not None and top == "sensors" else None
    front = () if system is None else system.programs
    chosen = options.params_of_each(names, params, front)
    target = _target(target, board, top)
    make = partial(Build, *estimators, params=chosen[: len(names)], word=word)
    build, choice = build_for(make, config, target)
    _check_route(target, board, route=route or bool(open_router(board)), seeds=seeds, clock=clock)
    expected = core_files(own, target)
    if board is not None:
        expected += project_files(board, system=system is not None)
    check_together(build.programs)
    check_sound(build)
    kept = list[str]()
    with output_folder(output, "compile", files=expected, kept=kept.append) as folder:
        core = build.core
        if target in TARGETS:
            check_memory(core.machine, core.image, TARGETS[target])
        part = TARGETS.get(target, TARGETS[TARGET_NAMES[0]])
        area: Mapped | Routed | None = None
        if route or synth:
            say(f"synthesis (yosys) for {part.title}")
        if route:
            area = route_core(core, part, seeds=seeds, clock_mhz=clock, progress=say)
        elif synth:
            area = map_core(core, part)
        say(f"{', '.join(own)} for {build.config}: Verilog")
        proven = write_core(folder, core, core_texts(build, recorded(build), target, area))
        whole: Mapped | Routed | None = None
        if board is not None:
            say(f"{board}: {top}")
            place = folder / project_folder(board)
            hz = None if clock is None else round(1e6 * clock)
            if hz is None and not open_router(board):
                hz = SYSTEM_CLOCK_HZ
            settings: Any = {"seeds": seeds, "progress": say}
            if system is None:
                whole = write_project(records_design(core), board, place, clock_hz=hz, **settings)
            else:
                hz = hz or ROUTED_CLOCK_HZ
                programs: list[Any] = [*estimators, *front]
                of = {e.name: v for e, v in zip(programs, chosen, strict=True) if v}
                made: Any = {"config": build.config, "word": word, "clock_hz": hz, "params": of}
                complete = system.core(estimators, **made)
                design, whole = write_system(place, board, complete, clock_hz=hz, **settings)
                if whole is None and synth:
                    say("synthesis of the complete system")
                    text = to_verilog(design, "system", instances=True)
                    whole = netlist_for(text, "system", TARGETS[target])
        data = together(
            core,
            [
                core_data(core.select(k), area, part.grade, part.device)
                | {"parameters": build.values[k]}
                | {"tolerances": {o.name: o.tolerance for o in e.outputs}}
                for k, e in enumerate(build.estimators)
            ],
        )
        data["made"] = plain(made_of(names, build, target, Path(output)))
        if choice:
            data["depth"] = choice
        if whole is not None:
            data["system"] = str(whole)
        write_text(folder / "report.json", json.dumps(data, indent=1) + "\n")
    lines = [choice] if choice else []
    lines.append(f"proven: {proven}")
    lines += [f"{name}: {x}" for name, x in (("core", area), ("board", whole)) if x is not None]
    result = _result(f"{output}: ", build, area, clock, lines)
    notes = [f"{Path(output) / name}: of an earlier core; kept, as it was edited" for name in kept]
    notes += [] if system is None else system.rate_notes(estimators)
    return replace(result, data=data, notes=(*result.notes, *notes))


def _result(
    head: str, build: Build, area: Mapped | Routed | None, clock: float | None, lines: Sequence[str]
) -> Result:
    """What was compiled: a row for each output, lines about programs, then ``lines``."""
    core = build.core
    routed = area.clock_mhz if isinstance(area, Routed) else None
    mhz = clock or routed or _CLOCK_MHZ
    word = core.machine.arithmetic.word
    notes = [note for e in build.estimators if (note := e.start_note(word))]
    rows, told = list[Row](), [f"{head}{core.machine.name}, W = {word}, core {core.identity}"]
    for number, (part, estimator) in enumerate(zip(core.parts, build.estimators, strict=True)):
        program, schedule = part.program, part.schedule
        told.append(
            f"{program.name}: interval {schedule.interval} cycles, at {mhz:g} MHz up to "
            f"{1e6 * mhz / schedule.interval:,.0f} updates/s"
        )
        told += [str(estimator.profile)] if estimator.profile else []
        claims, broken = unproven(Traced.of(build, number))
        told, notes = told + claims, notes + broken
        rows += [
            {"program": program.name, "output": name, "latency, cycles": cycles}
            for name, cycles in zip(program.output_names, schedule.latencies, strict=True)
        ]
    slow = routed is not None and clock is not None and routed < clock
    failures = [f"clock {routed} MHz, below {clock:g} MHz"] if slow else []
    return Result({}, {"outputs": rows}, "\n".join((*told, *lines)), notes, failures, JUDGED)


def _target(target: str | None, board: str | None, top: str) -> str:
    """The target: as said, or the part of the board, which holds such a project, or the default."""
    part = TARGET_NAMES[0]
    require_choice("top", top, TOPS)
    if board is not None:
        require_choice("board", board, BOARDS)
        part = BOARDS[board].target
        wanted = "a part that holds the complete system with its sensors"
        fix = "add --top records: a computer sends the records"
        good = BOARDS[board].holds_system or top != "sensors"
        require(good, "board", wanted, f"{part} of {board}", fix)
    if target is None:
        return part
    require_choice("target", target, TARGET_NAMES)
    good, wanted = board is None or target == part, f"{part}, the part of {board}"
    require(good, "target", wanted, f"--target {target}", "leave out --board or --target")
    return target


def _check_route(
    target: str, board: str | None, *, route: bool, seeds: int, clock: float | None
) -> None:
    """Raise InputError, or ToolMissing, unless a core can be routed on a target."""
    require_whole("seeds", seeds, 1, 1000)
    if clock is not None:
        require_whole("clock", int(clock) if math.isfinite(clock) else -1, 1, 1000)
    if route:
        check_routable(target)
    good = route or (seeds == 1 and (clock is None or board is not None))
    fix = "add --route and a target such as ecp5-25k, or --board ulx3s"
    where = "seeds" if seeds > 1 else "clock"
    require(good, where, "a design that is routed", "no --route", fix)


def check_routable(target: str) -> None:
    """Raise InputError unless an open tool routes ``target``, ToolMissing without it."""
    router = TARGETS[target].family.router if target in TARGETS else None
    if router is None:
        routed = dict.fromkeys(t.device.name for t in TARGETS.values() if t.family.router)
        wanted, found = "a target that an open tool routes", f"--target {target}"
        fix = f"choose {', '.join(routed)}, or --synth for area alone"
        raise InputError.at("route", wanted=wanted, found=found, fix=fix)
    find_router(router)


def has_primitives(target: str) -> bool:
    """Whether ``core.v`` for a target has primitives of it: Spartan-6."""
    return target in TARGETS and TARGETS[target].family is SPARTAN6


def core_files(names: Sequence[str], target: str) -> list[str]:
    """Names of the texts of these estimators' core (`core_texts`), and of the report."""
    beside = templates.integration_names(generic=not has_primitives(target))
    firmware = [f"firmware/{stem(name)}{end}" for name in names for end in (".c", ".h")]
    return ["core.v", "report.json", *templates.REGISTER_FILES, *beside, *firmware]


def open_router(board: str | None) -> Router | None:
    """The open router of a board's part, which makes its bitstream; None: ISE makes it."""
    return TARGETS[BOARDS[board].target].family.router if board in BOARDS else None


def project_folder(board: str) -> str:
    """Folder of a board's project."""
    return f"{'board' if open_router(board) else 'ise'}-{board}"


def project_files(board: str, *, system: bool) -> list[str]:
    """Names of the files of a board's project; ``system``: complete system with register map."""
    if router := open_router(board):
        names = ["README.txt", "top.v", router.pins[1], router.bitstream]
    else:
        names = ["README.txt", "build.bat", "build.sh", "build_top.bat", "build_top.sh"]
        names += ["top.prj", "top.ucf", "top.v", "top.xst"]
    names += templates.REGISTER_FILES if system else []
    return [f"{project_folder(board)}/{name}" for name in names]


def write_system(
    folder: Path, board: str, core: Core, *, clock_hz: int, **settings: Any
) -> tuple[Any, Routed | None]:
    """Write the project of a complete system, with its register map beside it."""
    system, description = board_system().design(core, clock_hz)
    routed = write_project(lambda _: system, board, folder, clock_hz=clock_hz, **settings)
    for file, text in templates.register_files(description).items():
        write_text(folder / file, text)
    return system, routed


def core_texts(
    build: Build, records: Sequence[Recorded], target: str, area: Mapped | Routed | None = None
) -> dict[str, str]:
    """Verilog, C, register map, texts and bench of a core for one of `TARGET_NAMES`, by file.

    ``records`` of every program are the bench's (`sim.levels.rtl.recorded`); area and clock are
    for the README.
    """
    core = build.core
    description = describe(core, {e.name: e.summary for e in build.estimators})
    primitives = has_primitives(target)
    verilog = core.verilog(instances=primitives, identified=True)
    texts = {
        "core.v": templates.verilog_head(description, instances=primitives) + verilog,
        **templates.register_files(description),
        **templates.integration_files(description, records, generic=not primitives, area=area),
    }
    for part in core.parts:
        texts |= {f"firmware/{file}": text for file, text in emit_c(part.program).items()}
    return texts


def write_core(folder: Path, core: Core, texts: Mapping[str, str]) -> str:
    """Write texts of a core (`core_texts`); return what was proven of them.

    The microcode was proven when the core was built (`gateware.core`); the memories in the Verilog
    must hold it. Raises Refuted, and writes nothing, if they do not: a bug of the compiler.
    """
    check_memories(core.machine, core.image, texts["core.v"])
    for file, text in texts.items():
        (folder / file).parent.mkdir(exist_ok=True)
        write_text(folder / file, text)
    n = sum(len(part.program.ops) for part in core.parts)
    return f"{n} operation{'s' * (n != 1)}, microcode, all inputs"


def write_text(file: Path, text: str) -> None:
    """Write UTF-8 with line feeds on every operating system."""
    file.write_text(text, encoding="utf-8", newline="\n")


def together(core: Core, reports: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The report of a core from those of its programs; of a single one, its own."""
    if len(reports) == 1:
        return reports[0]
    return {
        "core": core.name,
        "config": core.machine.name,
        "word": core.machine.arithmetic.word,
        "digest": core.digest,
        "identity": core.identity,
        "resources": reports[0]["resources"],
        "fmax_mhz": reports[0]["timing"]["fmax_mhz"],
        "programs": dict(zip(core.names, reports, strict=True)),
    }
