"""Where two levels first differ: named value, step, cycle; and a file that reproduces it."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boresight.disk.output import OutputFile
from boresight.firmware.build import CModel
from boresight.gateware.core import Core, build_core
from boresight.gateware.machine import CONFIGS
from boresight.model.errors import InputError
from boresight.model.words.check import check_program
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.rtl.cosim import RtlSimulation, SimulationFailed
from boresight.sim.rtl.sharing import selection

__all__ = [
    "Divergence",
    "first_divergence_rtl",
    "load_reproducer",
    "replay_reproducer",
    "write_reproducer",
]


_WANTED = "a reproducer of `boresight check`"


@dataclass(frozen=True)
class Divergence:
    """The first difference.

    ``cycle`` counts from the update's first input word; None for levels without cycles.
    """

    level: str
    step: int
    value: str
    cycle: int | None
    wanted: int
    found: int | None

    def __str__(self) -> str:
        at = "" if self.cycle is None else f", cycle {self.cycle}"
        found = "X" if self.found is None else str(self.found)
        return (
            f"{self.level}: first difference in value {self.value}, step {self.step}{at}: "
            f"wanted {self.wanted}, found {found}"
        )


def words_of_step(program: Program, inputs: IntArray, step: int) -> tuple[Program, list[int]]:
    """The program with the states it has before ``step`` as initial words, and all words of it."""
    from boresight.sim.records.segments import with_state_outputs

    values = list(program.values)
    if step:
        words, _ = CModel(with_state_outputs(program)).update(inputs[:step])
        for k, (state, _) in enumerate(program.states):
            values[state] = dataclasses.replace(
                values[state], initial=int(words[-1, len(program.outputs) + k])
            )
    at_step = dataclasses.replace(program, values=tuple(values))
    machine = Interpreter(at_step)
    machine.update(inputs[step][:, None])
    return at_step, [int(w[0]) for w in machine.values_before_commit()]


def first_divergence_rtl(
    core: Core, verilog: str, inputs: IntArray, step: int, *, simulator: str
) -> Divergence | None:
    """Run up to ``step`` again, recording every register write of it, and compare by name.

    Of a core with several programs the one at hand runs alone.
    """
    program = core.schedule.program
    _, words = words_of_step(program, inputs, step)
    simulation = RtlSimulation(
        verilog,
        word=program.arithmetic.word,
        n_inputs=len(program.inputs),
        n_outputs=len(program.outputs),
        lanes=core.machine.lanes,
        simulator=simulator,
    )
    run = simulation.run(
        inputs[: step + 1],
        max_interval=core.schedule.interval,
        trace=step,
        allow_unknown=True,
        bus_writes=selection(core),
    )
    sign = 1 << (program.arithmetic.word - 1)
    landed = {
        (core.schedule.ends[k].lane, core.schedule.write_cycle(k)): op.dest
        for k, op in enumerate(program.ops)
    }
    seen = set()
    for w in run.writes:
        value = landed.get((w.lane, w.cycle))
        if value is None:
            continue
        seen.add(value)
        found = None if w.word is None else (w.word ^ sign) - sign
        if found != words[value]:
            return Divergence("rtl", step, program.values[value].name, w.cycle, words[value], found)
    for (_, cycle), value in sorted(landed.items(), key=lambda x: x[0][1]):
        if value not in seen:
            return Divergence("rtl", step, program.values[value].name, cycle, words[value], None)
    return None


def write_reproducer(
    file: OutputFile, program: Program, inputs: IntArray, step: int, *, config: str, level: str
) -> None:
    """One file that shows the difference again.

    It holds the program with the states before ``step`` as its start, one input record, and the
    words that the integer model gives.
    """
    at_step, _ = words_of_step(program, inputs, step)
    outputs, saturated = Interpreter(at_step).update(inputs[step][:, None])
    file.write(
        json.dumps(
            {
                "boresight_reproducer": 1,
                "level": level,
                "config": config,
                "step": int(step),
                "inputs": [[int(w) for w in inputs[step]]],
                "outputs": [[int(w) for w in outputs[:, 0]]],
                "saturated": [bool(saturated[0])],
                "program": json.loads(at_step.to_json()),
            },
            indent=1,
        )
        + "\n"
    )


def load_reproducer(path: Path) -> dict[str, Any]:
    """Read a reproducer file, with the program under ``program``.

    Raises
    ------
    InputError
        It cannot be read, is something else, or holds a program that no core could run.
    """
    data = read_json(path, _WANTED)
    if not isinstance(data, dict):
        found = kind_of(data)
    elif data.get("boresight_reproducer") != 1:
        found = "another kind of JSON"
    else:
        try:
            data["program"] = Program.from_json(json.dumps(data.get("program")))
            check_program(data["program"])
            _check_record(data)
            return data
        except (AttributeError, KeyError, TypeError):
            found = "a program that lacks something, or has too much"
        except ValueError as error:
            found = str(error)
    raise InputError.at(
        str(path), wanted=_WANTED, found=found, fix="give the file that boresight check wrote"
    )


def _check_record(data: dict[str, Any]) -> None:
    """Raise ValueError unless there is one record of words in and out, for a known machine."""
    program: Program = data["program"]
    low, high = program.arithmetic.min_int, program.arithmetic.max_int
    for key, count in (("inputs", len(program.inputs)), ("outputs", len(program.outputs))):
        rows = data.get(key)
        if not (
            isinstance(rows, list)
            and len(rows) == 1
            and isinstance(rows[0], list)
            and len(rows[0]) == count
            and all(type(word) is int and low <= word <= high for word in rows[0])
        ):
            raise ValueError(f"no record of {count} words in {key}")
    if data.get("config") not in list(CONFIGS):
        raise ValueError(f"the config {kind_of(data.get('config'))}")


def replay_reproducer(path: Path, *, simulator: str = "verilator") -> list[str]:
    """Run a reproducer on every level; a line per level that differs (none: it is mended)."""
    data = load_reproducer(path)
    program: Program = data["program"]
    inputs = np.array(data["inputs"], dtype=np.int64)
    wanted = np.array(data["outputs"], dtype=np.int64)
    lines = []
    out, _ = Interpreter(program).update(inputs[0][:, None])
    if not np.array_equal(out.T, wanted):
        lines.append("fixed: outputs differ")
    out, _ = CModel(program).update(inputs)
    if not np.array_equal(out, wanted):
        lines.append("c: outputs differ")
    core = build_core(program, data["config"], restarts=0)
    try:
        run = RtlSimulation(
            core.verilog(instances=False),
            word=program.arithmetic.word,
            n_inputs=len(program.inputs),
            n_outputs=len(program.outputs),
            lanes=core.machine.lanes,
            simulator=simulator,
        ).run(inputs, max_interval=core.schedule.interval)
        if not np.array_equal(run.outputs, wanted):
            lines.append("rtl: outputs differ")
    except SimulationFailed as error:
        lines.append(f"rtl: {error}")
    return lines
