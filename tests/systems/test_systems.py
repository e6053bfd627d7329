"""Every system: all forms give the same words, fixed point is near float64, targets are met."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

import boresight
from boresight.model.resolve import estimator_of
from boresight.sim.compare.verdict import judge
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, make_level
from boresight.sim.worlds.loop import close_loop, parting
from boresight.sim.worlds.world import world_of

#: World, estimator and machine of each system.
SYSTEMS = {
    "array": ("turning_array", "array_attitude", "small"),
    "battery": ("discharge", "battery", "small"),
    "ekf2": ("flight", "ekf2", "small-2048"),
    "ins_gnss": ("journey", "ins_gnss", "small-1024"),
    "mls": ("on_deck", "mls_attitude", "fast"),
    "pmsm": ("motor", "pmsm", "small"),
    "radar": ("two_radars", "registration", "fast"),
    "satcom": ("on_the_move", "satcom", "small"),
}
#: Experiments that take some seconds with two runs.
QUICK = {"battery"}
FEW, MANY = 40, 4000
#: Records after which fixed point gets no farther from float64; the radar's correction begins at a
#: step that may differ from float64's.
FAR = dict.fromkeys(SYSTEMS, 1000) | {"battery": MANY, "ins_gnss": MANY, "radar": 700}


@cache
def build_of(system: str) -> Build:
    _, name, config = SYSTEMS[system]
    return Build(estimator_of(name), config=config)


def loops(system: str, levels: tuple[str, ...], steps: int):
    build, world = build_of(system), world_of(SYSTEMS[system][0])
    for level in levels:
        with make_level(level, build) as form:
            yield build, close_loop(world, form, steps=steps)


@pytest.mark.parametrize("steps", [FEW, pytest.param(MANY, marks=pytest.mark.soak)])
@pytest.mark.parametrize("system", SYSTEMS)
def test_every_form_gives_the_same_words(system: str, steps: int) -> None:
    """The emitted C, the integer interpreter and the RTL close the same loop."""
    (build, first), *others = loops(system, ("c", "fixed", "rtl"), steps)
    for _, other in others:
        difference = parting(first, other)
        assert difference is None, difference


@pytest.mark.parametrize("system", SYSTEMS)
def test_fixed_point_is_near_float64(system: str) -> None:
    """Within the tolerances that the system declares, and nothing saturates."""
    ((build, loop),) = loops(system, ("c",), FAR[system])
    floating = CompiledFloat(build).run_anew(loop.inputs)
    found = judge(build, 0, loop.inputs, loop.run, floating, {})
    assert found.good, found.faults()


@pytest.mark.parametrize(
    "system", [s if s in QUICK else pytest.param(s, marks=pytest.mark.soak) for s in SYSTEMS]
)
def test_binding_targets_are_met(system: str, tmp_path: Path) -> None:
    result = boresight.experiment(system, runs=2, output=tmp_path)
    assert result.good, str(result)
    assert (tmp_path / f"{system}.html").read_text().count("<svg") >= 1
