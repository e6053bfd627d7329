"""A build: programs with parameters, their nodes, and one core."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.sim.compare.check import Check
from boresight.sim.levels import rtl
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.rtl.sharing import rounds
from tests.support.linked import Inner, Middle, Outer


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
    with pytest.raises(
        InputError, match=r"^config: wanted one of small, fast, small-1024, fast-1024, found 'huge'"
    ):
        Build(estimator("complementary"), config="huge").core  # noqa: B018


#: Records of estimators that read each other.
N = 300


def record(seed: int) -> Record:
    rng = np.random.default_rng(seed)
    return Record.of({name: rng.uniform(-0.99, 0.99, N) for name in "abcdef"})


@pytest.fixture(scope="module")
def linked() -> Build:
    return Build(Outer(), Middle(), Inner())


def test_who_reads_whom(linked: Build) -> None:
    assert linked.links == [
        {1: (1, "sum"), 2: (2, "product")},
        {0: (2, "half"), 2: (2, "product")},
        {},
    ]
    assert linked.order == [2, 1, 0]
    assert [linked.streamed(k) for k in range(3)] == [[0, 3], [1, 3], [0, 1]]


def test_records_are_filled_with_what_is_kept(linked: Build) -> None:
    counts = (6, 4, 2)
    given = {2: {"half": np.array([0.5, 0.25]), "product": np.array([0.125, -0.5])}}
    filled = linked.filled(1, np.zeros((4, 4)), given, counts)
    # Before the first update the state's start and 0, then the last complete one.
    assert set(filled[:, 0]) <= {0.75, 0.5, 0.25} and set(filled[:, 2]) <= {0.0, 0.125, -0.5}
    steps = {0.75: 0, 0.5: 1, 0.25: 2}
    seen = [steps[v] for v in filled[:, 0]]
    assert seen == sorted(seen) and seen[-1] == 2
    assert [(0.0, 0.125, -0.5)[k] for k in seen] == filled[:, 2].tolist()
    given |= {1: {"sum": np.full(4, -3.0)}}
    wild = linked.filled(0, np.zeros((6, 4)), given, counts)
    tame = linked.filled(0, np.zeros((6, 4)), given, counts, clamp=True)
    assert wild[:, 1].min() == -3.0 and tame[:, 1].min() == -1.5


@pytest.mark.parametrize("config", ["small", "fast"])
def test_every_level_is_equal(config: str) -> None:
    check = Check(Build(Outer(), Middle(), Inner(), config=config), simulator="verilator")
    results = check.run(record(1))
    for result in results:
        assert {level.level for level in result.levels} == {"fixed", "c", "rtl"}
        assert all(x.n_mismatch == 0 and x.n_total == N for x in result.levels), result
        assert not any(x.error for x in result.levels)


def test_a_level_that_reads_another_update_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were the turns not those of the core, bits would differ."""
    monkeypatch.setattr(rtl, "rounds", lambda counts: rounds(counts, seed=1))
    check = Check(Build(Outer(), Middle(), Inner()), levels=("rtl",), simulator="verilator")
    outer, middle, inner = check.run(record(2))
    assert outer.levels[0].n_mismatch > 10 and middle.levels[0].n_mismatch > 10
    assert inner.levels[0].n_mismatch == 0
