"""A build: programs with parameters, their nodes, and one core."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.sim.levels.build import Build


def test_everything_is_made_once() -> None:
    build = Build(estimator("complementary"), word=24, urgent=1)
    assert build.programs is build.programs and build.core is build.core
    (program,) = build.programs
    assert program.arithmetic.word == 24 and build.core.program is program
    assert build.core.schedule.urgent == 1 and build.core.machine.name == "small"
    own = Build(estimator("complementary"), word=24).core.schedule.urgent
    assert own == estimator("complementary").urgent != 1
    (nodes,) = build.nodes
    assert {program.values[n].name for n in nodes} >= {i.name for i in build.estimators[0].inputs}


def test_parameters_are_of_their_estimator() -> None:
    two = (estimator("complementary"), estimator("complementary_as_printed"))
    plain, moved = Build(*two), Build(*two, params=[None, {"kp_roll_per_s": 4.0}])
    assert plain.params == (None, None)
    assert moved.programs[0] == plain.programs[0] and moved.programs[1] != plain.programs[1]
    n = moved.programs[1].find("kp_roll_per_s")
    assert moved.programs[1].format(n).real(moved.programs[1].values[n].initial) == 4.0


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"kp_roll_per_s": -1.0}, r"^parameter kp_roll_per_s: wanted 0 to 32 1/s, .*$"),
        ({"kp_roll_per_s": float("nan")}, r"^parameter kp_roll_per_s: wanted .*nan.*$"),
        ({"gain": 1.0}, r"^parameter gain: wanted one of .*, found 'gain'; .*$"),
    ],
)
def test_bad_parameters_are_refused_before_any_work(params, message) -> None:
    with pytest.raises(InputError, match=message):
        Build(estimator("complementary"), params=[params])


def test_bad_machines_are_refused() -> None:
    with pytest.raises(InputError, match=r"^word: wanted 18 to 32 bits, found 17; .*$"):
        Build(estimator("complementary"), word=17).programs  # noqa: B018
    with pytest.raises(InputError, match=r"^config: wanted one of small, fast, found 'huge'"):
        Build(estimator("complementary"), config="huge").core  # noqa: B018
