"""A reproducer shows a difference again on every level, until it is mended."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.model.tools.files import OutputFile
from boresight.sim.compare.reproducer import (
    load_reproducer,
    program_at,
    replay_reproducer,
    write_reproducer,
)
from boresight.sim.levels.build import Build
from boresight.sim.levels.rtl import Simulated
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.faulty import All, words_and_states

CHANGED = "found a program that was changed"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    build, inputs = Build(All(), word=24), [0.5, -3.0, 2.5]
    words, states = words_and_states(build, inputs)
    path = tmp_path / "reproducer.json"
    at_step = program_at(build.programs[0], states[1])
    write_reproducer(OutputFile(path), at_step, words[2], 2, config="fast", level="rtl")
    return path


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda data: data["outputs"][0].append(0), "no record of 1 words in outputs"),
        (lambda data: data["program"]["ops"][0]["terms"][0].update(shift=9), CHANGED),
        (lambda data: data["program"]["ops"][0].pop("terms"), CHANGED),
        (lambda data: data.pop("program"), CHANGED),
    ],
)
def test_what_no_core_could_run_is_refused(file: Path, change: Any, found: str) -> None:
    text = file.read_text()
    assert text.startswith('{\n "boresight_reproducer": 1,\n')
    data = json.loads(text)
    change(data)
    file.write_text(json.dumps(data))
    with pytest.raises(InputError, match=found):
        load_reproducer(file)


def test_sound_levels_differ_in_nothing(file: Path) -> None:
    assert replay_reproducer(file) == []


def test_levels_that_differ_are_named(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = json.loads(file.read_text())
    data["outputs"][0][0] ^= 1
    file.write_text(json.dumps(data))

    def broken(self: Simulated, records: Any) -> Any:
        assert self.tool == "icarus"
        raise SimulationFailed("no such thing")

    monkeypatch.setattr(Simulated, "run", broken)
    assert replay_reproducer(file, simulator="icarus") == [
        "fixed: outputs differ", "c: outputs differ", "rtl: no such thing",
    ]  # fmt: skip
