"""The programs before the filters: interpreter, C and core agree word for word; all fit."""

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.gateware.microcode.emulator import Emulator
from boresight.gateware.register_map import register_map, register_map_files
from boresight.gateware.system.programs import FILTERS, system_core
from boresight.model.front import FRONT
from boresight.model.words.interpreter import Interpreter
from tests.support.random_program import random_inputs

CONFIG = pytest.mark.parametrize("config", ["small", "fast"])


@pytest.mark.parametrize("word", [26, 32])
@pytest.mark.parametrize("name", sorted(FRONT))
def test_interpreter_and_c(name: str, word: int) -> None:
    program = FRONT[name]().compile(word=word)
    rows = np.array(random_inputs(program, 1, 300), dtype=np.int64)
    machine = Interpreter(program)
    wanted = [machine.update(row[:, None]) for row in rows]
    outputs, saturated = CModel(program).update(rows)
    assert (outputs == [out[:, 0] for out, _ in wanted]).all()
    assert (saturated == [bool(s[0]) for _, s in wanted]).all()


@CONFIG
@pytest.mark.parametrize("name", sorted(FRONT))
def test_interpreter_and_core(name: str, config: str) -> None:
    program = FRONT[name]().compile()
    core = build_core(program, config, restarts=2)
    emulator, machine = Emulator(core.machine, core.image), Interpreter(program)
    for row in random_inputs(program, 2, 60):
        record = emulator.update(row)
        assert record.outputs == machine.update(np.array(row)[:, None])[0][:, 0].tolist()
        assert record.cycles == core.schedule.length


@CONFIG
def test_all_fit(config: str) -> None:
    core = system_core(config=config, restarts=0)
    assert core.names == (*FILTERS, "calibrate_inertial", "calibrate_field", "compass_field")
    assert sum(len(p.program.states) for p in core.parts) <= 128
    files = register_map_files(core)
    assert "calibrate_inertial.gyro_xx" in files["registers.json"]
    addresses = [r.address for r in register_map(core).parameters]
    assert len(set(addresses)) == len(addresses)
