"""Forms of an estimator: those that `run` runs, the cycles that `compile` reports."""

from pathlib import Path

import boresight
from boresight.model.resolve import estimator_of
from boresight.sim.experiments.forms import schedules_of
from tests.support.strangers import EXAMPLES


def test_schedules_are_those_of_the_compiled_core(tmp_path: Path) -> None:
    names = [str(EXAMPLES / f"{name}.py") for name in ("kalman", "biquad")]
    found = schedules_of(*map(estimator_of, names))
    assert list(found) == ["small", "fast"]
    for config, schedules in found.items():
        core = boresight.compile(*names, config=config, synth=False, output=tmp_path / config)
        for schedule, program in zip(schedules, core.programs, strict=True):
            assert schedule.interval == program.interval_cycles
            assert schedule.latency == max(program.latency_cycles.values())
