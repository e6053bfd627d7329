"""The identities of all shipped programs, so that a change of one is seen, and meant.

``BORESIGHT_UPDATE=1 pytest -m "" tests/bits/test_digests.py`` rewrites the file.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from amaranth.back import rtlil

from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.boards.top import Top
from boresight.gateware.bus.axi import AxiCore
from boresight.gateware.core import Core, build_shared_core, schedule
from boresight.gateware.machine import CONFIGS
from boresight.model import ops
from boresight.model.attitude import FILTERS
from boresight.model.attitude.front import FRONT
from boresight.model.attitude.mekf import Mekf
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from tests.support.estimators import ALL, program_of
from tests.support.random_functions import random_functions
from tests.support.random_program import random_program

pytestmark = pytest.mark.pythons

FILE = Path(__file__).with_name("digests.json")


class Transcendental(Estimator):
    """The functions that are made of polynomials."""

    inputs = (Input("a", -20.0, 3.0), Input("b", 0.01, 40.0), Input("c", -4.0, 5.0))
    outputs = (Output("exp"), Output("log"), Output("tanh"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"exp": ops.exp(u.a), "log": ops.log(u.b), "tanh": ops.tanh(u.c)}


#: Programs of no shipped estimator.
MORE = {"mekf_six_axis": partial(Mekf, "none"), "transcendental": Transcendental}


def kept(part: str, result: dict[str, Any]) -> None:
    """Compare one part of the file, or rewrite it."""
    data = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    if os.environ.get("BORESIGHT_UPDATE"):
        text = json.dumps({**data, part: result}, indent=1, sort_keys=True) + "\n"
        FILE.write_text(text, encoding="utf-8")
        return
    changed = sorted(k for k in data[part].keys() | result if data[part].get(k) != result.get(k))
    assert not changed, (
        f"these changed: {changed}; if that is meant: BORESIGHT_UPDATE=1 pytest -m '' {__file__}"
    )


def memories(core: Core) -> str:
    """Digest of microcode, first words of the registers and tables; not of the build identifier."""
    image = core.image
    return hashlib.sha256(repr((image.rom, image.registers, image.tables)).encode()).hexdigest()


@cache
def filters(config: str) -> Core:
    """The core of all four filters."""
    return build_shared_core([program_of(name) for name in FILTERS], config)


def test_programs() -> None:
    kept(
        "programs",
        {
            f"{name} {word}": program.digest
            for name, kind in {**ALL, **FRONT, **MORE}.items()
            for word in (32, kind().least_word)
            for program in [kind().compile(word=word) if name in MORE else program_of(name, word)]
        },
    )


def test_random_programs() -> None:
    """Of all operations, in forms that no shipped program has."""
    results = {}
    for word in (32, 18):
        digests = hashlib.sha256()
        for seed in range(30):
            with contextlib.suppress(InputError):
                digests.update(random_functions(seed, word)[0].digest.encode())
        results[str(word)] = digests.hexdigest()
    kept("random programs", results)


def test_schedules_of_random_programs() -> None:
    results = {}
    for config, machine in CONFIGS.items():
        digests = hashlib.sha256()
        for seed in range(8):
            program = random_program(seed, n_ops=30 + 5 * seed, recent=seed % 5 / 4)
            s = schedule(replace(program, urgent=1), machine)
            data = {name: getattr(s, name) for name in ("source", "gets", "length", "urgent")}
            data |= {"machine": machine.name, "program": asdict(s.program) | {"urgent": None}}
            data["slots"] = [asdict(slot) for slot in s.slots]
            digests.update(json.dumps(data, indent=1, sort_keys=True).encode())
        results[config] = digests.hexdigest()
    kept("schedules of random programs", results)


@pytest.mark.pythons
def test_signals() -> None:
    """Every signal has a name, the same on each Python: Amaranth takes names out of its bytecode.

    ``a, b = Signal(), Signal()`` has no names, or not everywhere: one statement each, or ``name=``.
    """
    core = system_core(("complementary", "mekf"))
    designs = {
        "system": (AttitudeSystem(core=core), ""),
        "core on a board": (Top(core=filters("small"), clock_hz=100e6), "xc6slx9"),
        "AXI": (AxiCore(word=24), ""),
    }
    results = {}
    for name, (design, device) in designs.items():
        text = rtlil.convert(design, platform=SimpleNamespace(device=device), emit_src=False)
        signals = re.findall(r"^ +wire (?:width (\d+) )?.*?\\(\S+)$", text, re.M)
        assert not [signal for _, signal in signals if signal.startswith("$")]
        results[name] = hashlib.sha256(repr(signals).encode()).hexdigest()
    kept("signals", results)


def test_memories() -> None:
    """Memories of the core with all filters, and the cycles of each."""
    results: dict[str, Any] = {}
    for config in CONFIGS:
        core = filters(config)
        results[config] = memories(core)
        for part in core.parts:
            cycles = [part.schedule.latency, part.schedule.interval]
            results[f"{config} {part.program.name}: latency, interval"] = cycles
    kept("memories", results)
