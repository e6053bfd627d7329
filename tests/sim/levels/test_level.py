"""Levels: builds, registry, one update and many."""

import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.step import Values
from boresight.sim.compare.check import Check
from boresight.sim.levels.build import Build, Exchange
from boresight.sim.levels.integer import Interpreted
from boresight.sim.levels.registry import LEVELS, level_of, make_level
from boresight.sim.levels.rtl import Simulated
from boresight.sim.records.record import Record
from boresight.sim.rtl.sharing import Rounds
from tests.support.estimators import Leaky
from tests.support.linked import Inner, Middle, Outer
from tests.support.shared import Beside, Motion, Row

# -- levels: one update at a time and all at once, resets, and how they agree ---------------------

#: Levels that need no simulator: tests/sim/levels/test_rtl.py and tests/sim/rtl have the others.
QUICK = tuple(name for name in LEVELS if name not in ("rtl", "netlist"))


RECORDS = np.array([[1.0, 0.0], [0.0, 0.25], [-2.0, -1.0], [0.5, 0.5]])
#: By hand, with rate 0.25.
Y = [1.0, 0.75, 0.0625, 0.171875]
SUM = [1.0, 0.0, 3.0625, -1.328125]


@pytest.mark.parametrize("name", QUICK)
def test_by_hand(name: str) -> None:
    level = make_level(name, Build(Leaky(), params=[{"rate": 0.25}]))
    outcome = level.run(RECORDS)
    assert list(outcome.outputs) == ["y", "sum"]
    assert np.abs(outcome.outputs["y"] - Y).max() < 2e-8
    assert np.abs(outcome.outputs["sum"] - SUM).max() < 2e-8
    assert level.name == name
    assert (outcome.words is None) == (outcome.saturated is None) == (name in ("numpy", "float"))
    level.close()


@pytest.mark.parametrize("name", QUICK)
def test_steps_are_a_run_and_reset_starts_anew(name: str) -> None:
    level = make_level(name, Build(Leaky(), params=[{"rate": 0.25}]))
    whole = level.run(RECORDS).outputs
    gone_on = level.run(RECORDS).outputs  # goes on where the last one stopped
    assert gone_on["y"][0] == pytest.approx(0.75 * Y[-1] + 0.25, abs=2e-8)
    assert (level.run_anew(RECORDS).outputs["y"] == whole["y"]).all()
    level.reset()
    steps = [level.step(record) for record in RECORDS]
    for output, values in whole.items():
        assert [step.outputs[output].tolist() for step in steps] == [[v] for v in values]
    assert level.step(RECORDS[0]).outputs == {o: v[:1] for o, v in gone_on.items()}
    level.reset()
    halves = [level.run(RECORDS[:3]), level.run(RECORDS[3:])]
    for output, values in whole.items():
        assert np.concatenate([h.outputs[output] for h in halves]).tolist() == values.tolist()
    level.close()


def test_parameters_reach_every_level() -> None:
    for name in QUICK:
        level = make_level(name, Build(Leaky(), params=[{"rate": 0.0}]))
        assert level.step(RECORDS[1]).outputs["y"] == 1.0
        with pytest.raises(InputError, match="^parameter rate: wanted 0 to 1"):
            make_level(name, Build(Leaky(), params=[{"rate": 2.0}]))


def test_word_width_reaches_the_integers() -> None:
    for name in ("fixed", "c"):
        outcome = make_level(name, Build(Leaky(), word=18, params=[{"rate": 0.25}])).run(RECORDS)
        assert outcome.words is not None and np.abs(outcome.words).max() < 1 << 17
        assert 1e-7 < np.abs(outcome.outputs["sum"] - SUM).max() + 1e-6 < 1e-3
    with_rate = Build(Leaky(), word=18, params=[{"rate": 0.25}])
    assert np.array_equal(Interpreted(with_rate).run(RECORDS).words, outcome.words)


class Turning(Estimator):
    """A phase, told as unsigned turns; the same as half turns."""

    inputs = (Input("a", -4.0, 4.0),)
    outputs = (Output("phase", "turn"), Output("half", "ht"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"phase": ops.wrap_turns(u.a), "half": ops.wrap_ht(2.0 * u.a)}


@pytest.mark.parametrize("name", QUICK)
def test_turns_are_told_from_zero_to_one(name: str) -> None:
    level = make_level(name, Build(Turning()))
    outcome = level.run(np.array([[-0.25], [0.5], [3.75], [-4.0]])).outputs
    assert outcome["phase"].tolist() == [0.75, 0.5, 0.75, 0.0]
    assert outcome["half"].tolist() == [-0.5, -1.0, -0.5, 0.0]
    level.reset()
    assert level.step(np.array([-0.125])).outputs["phase"] == 0.875


class Line(Estimator):
    """A delay line, and two states that change places."""

    inputs = (Input("a", -1.0, 1.0),)
    states = tuple(
        State(name, -1.0, 1.0, initial=first)
        for name, first in {"p": 0.5, "q": -0.5, "r": 0.25, "s": 0.5, "t": 0.75}.items()
    )
    outputs = (Output("last"), Output("p"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Every next state is what another one was before."""
        states = {"p": x.q, "q": x.p, "r": u.a, "s": 0.5 * x.r, "t": x.s}
        return states, {"last": x.t, "p": states["p"]}


@pytest.mark.parametrize("name", QUICK)
def test_states_change_all_at_once(name: str) -> None:
    outcome = make_level(name, Build(Line())).run(np.array([[0.25], [0.5], [0.75], [1.0]])).outputs
    assert outcome["last"].tolist() == [0.75, 0.5, 0.125, 0.125]
    assert outcome["p"].tolist() == [-0.5, 0.5, -0.5, 0.5]


@pytest.mark.parametrize("name", QUICK)
def test_runs_side_by_side(name: str) -> None:
    """Each is a run of its own; one update of all of them is a step."""
    build = Build(Leaky(), params=[{"rate": 0.25}])
    level, alone = make_level(name, build, runs=3), make_level(name, build)
    records = np.stack([RECORDS, -RECORDS, 4.0 * RECORDS.clip(-0.5, 0.5)], axis=1)
    whole = level.run_anew(records)
    level.reset()
    steps = [level.step(row) for row in records]
    assert (level.name, level.runs) == (name, 3)
    for k in range(3):
        wanted = alone.run_anew(records[:, k])
        for output, values in wanted.outputs.items():
            assert whole.outputs[output][:, k].tolist() == values.tolist()
            assert [s.outputs[output][0, k] for s in steps] == values.tolist()
        for part in ("words", "saturated"):
            array = getattr(wanted, part)
            assert array is None or (getattr(whole, part)[:, k] == array).all()
    level.close()


# -- A build: programs with parameters, their nodes, and one core ---------------------------------


def test_parameters_are_of_their_estimator() -> None:
    two = (estimator("complementary"), estimator("complementary_as_printed"))
    plain, moved = Build(*two), Build(*two, params=[None, {"kp_roll_per_s": 4.0}])
    assert plain.params == (None, None)
    assert moved.programs[0] == plain.programs[0] and moved.programs[1] != plain.programs[1]
    n = moved.programs[1].find("kp_roll_per_s")
    assert moved.programs[1].format(n).real(moved.programs[1].values[n].initial) == 4.0
    with pytest.raises(ValueError, match="shorter"):
        Build(*two, params=[None])


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


#: Records of estimators that read each other.
N = 300


def record(seed: int) -> Record:
    rng = np.random.default_rng(seed)
    columns = {name: rng.uniform(-0.99, 0.99, N) for name in "abcdef"}
    columns |= {name: rng.uniform(-0.99, 0.99, N) for name in ("push", "seen", "unread")}
    return Record.of(columns | {name: rng.uniform(0.0, 0.5, N) for name in ("dt", "trust")})


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
    source = {2: {"half": np.array([0.5, 0.25]), "product": np.array([0.125, -0.5])}}
    exchange, tame = Exchange(linked), Exchange(linked, clamp=True)
    for going in (exchange, tame):
        going.begin(counts)
        going.give(2, source[2])
    filled = exchange.filled(1, np.zeros((4, 4)))
    # Before the first update the state's start and 0, then the last complete one.
    assert set(filled[:, 0]) <= {0.75, 0.5, 0.25} and set(filled[:, 2]) <= {0.0, 0.125, -0.5}
    steps = {0.75: 0, 0.5: 1, 0.25: 2}
    seen = [steps[v] for v in filled[:, 0]]
    assert seen == sorted(seen) and seen[-1] == 2
    assert [(0.0, 0.125, -0.5)[k] for k in seen] == filled[:, 2].tolist()
    wild, limited = [], []
    for going, rows in ((exchange, wild), (tame, limited)):
        going.give(1, {"sum": np.full(4, -3.0)})
        rows += going.filled(0, np.zeros((6, 4)))[:, 1].tolist()
    assert min(wild) == -3.0 and min(limited) == -1.5


@pytest.fixture(scope="module")
def sharing() -> Build:
    return Build(Row(), Motion(), Beside())


@pytest.mark.parametrize("of", ["linked", "sharing"])
def test_pieces_read_what_the_whole_reads(of: str, request: pytest.FixtureRequest) -> None:
    """Streams of other lengths, of which some end: on every level, words of all pieces."""
    linked: Build = request.getfixturevalue(of)
    rng = np.random.default_rng(8)
    lengths = (40, 25, 31)
    records = [
        rng.uniform(-0.99, 0.99, (n, len(e.inputs)))
        for n, e in zip(lengths, linked.estimators, strict=True)
    ]
    for name in ("float", "fixed", "c"):
        kind = level_of(name)
        levels = [make_level(name, linked, k) for k in range(3)]
        whole = kind.run_together(levels, records)
        exchange, parts = kind.exchange(levels), []
        for start in range(0, 40, 7):
            piece = [x[start : start + 7] for x in records]
            parts.append(kind.run_together(levels, piece, exchange))
        for k in range(3):
            for output, values in whole[k].outputs.items():
                pieces = [part[k].outputs[output] for part in parts]
                assert np.concatenate(pieces).tolist() == values.tolist()


def test_shared_states_go_on_where_the_other_ended(sharing: Build) -> None:
    """On numpy's float64 and on integers: as the turns say, step by step."""
    rng = np.random.default_rng(5)
    records = [rng.uniform(0.0, 0.5, (30, len(e.inputs))) for e in sharing.estimators]
    for name in ("numpy", "float", "fixed", "c"):
        kind = level_of(name)
        levels = [make_level(name, sharing, k) for k in range(3)]
        exchange = kind.exchange(levels)
        runs = kind.run_together(levels, records, exchange)
        x = Values("state", {s.name: s.initial for s in sharing.estimators[0].states})
        for turn in exchange.turns:
            if (k := turn.number) == 2:  # has its own
                continue
            estimator = sharing.estimators[k]
            names = [i.name for i in estimator.inputs]
            u = Values("input", dict(zip(names, records[k][turn.start], strict=True)))
            after, out = estimator.step(x, u, None)
            x = Values("state", after)
            for output, value in out.items():
                assert abs(runs[k].outputs[output][turn.start] - value) < 1e-7, (name, k, turn)
        own = kind.run_together(levels, records)[2]
        assert (own.outputs["place"] - runs[0].outputs["place"]).any()


def test_what_is_wrong_with_shared_states_is_said() -> None:
    """Beyond a tolerance, and clamped: without the value, which a run from a reset would need."""

    class Fine(Motion):
        name, outputs = "motion", (Output("place", "m", tolerance=7.5e-9),)

    class Narrow(Row):
        name = "row"

        def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
            states, outputs = super().step(x, u, p)
            return states, {**outputs, "weight": ops.bounded(4.0 * u.seen, -0.5, 0.5, "wrong")}

    results = Check(Build(Narrow(), Fine()), levels=("c",)).run(record(3))
    narrow, fine = (result.accuracy for result in results)
    assert not narrow.good and narrow.saturated_updates > 10
    assert re.match(r"the first to saturate is step \d+; causes are not sought", narrow.culprit)
    assert not fine.good and fine.culprit == "causes are not sought where states are shared"


def together(what: str) -> list[Estimator]:
    return [Outer(), Middle(), Inner()] if what == "linked" else [Row(), Motion(), Beside()]


@pytest.mark.parametrize(
    ("what", "config"), [("linked", "small"), ("linked", "fast"), ("sharing", "small")]
)
def test_every_level_is_equal(what: str, config: str) -> None:
    check = Check(Build(*together(what), config=config), simulator="verilator")
    results = check.run(record(1))
    for result in results:
        assert {level.level for level in result.levels} == {"fixed", "c", "rtl"}
        assert all(x.n_mismatch == 0 and x.n_total == N for x in result.levels), result
        assert not any(x.error for x in result.levels)


def test_a_level_that_reads_another_update_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were the turns not those of the core, bits would differ."""
    exchange = Simulated.exchange

    def other(levels: Any) -> Exchange:
        going = exchange(levels)
        going._rounds = Rounds(seed=1)
        return going

    monkeypatch.setattr(Simulated, "exchange", other)
    check = Check(Build(Outer(), Middle(), Inner()), levels=("rtl",), simulator="verilator")
    outer, middle, inner = check.run(record(2))
    assert outer.levels[0].n_mismatch > 10 and middle.levels[0].n_mismatch > 10
    assert inner.levels[0].n_mismatch == 0
    row, motion, beside = Check(
        Build(*together("sharing")), levels=("rtl",), simulator="verilator"
    ).run(record(2))
    assert row.levels[0].n_mismatch > 10 and motion.levels[0].n_mismatch > 10
    assert beside.levels[0].n_mismatch == 0
    # Run again by itself, from the states that the other left, the update is right.
    assert row.levels[0].divergence.endswith("with 3 programs in turns")
