"""Slices, every n-th row and gaps: the same rows in one piece and in many."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight import Estimator, Input, Output, State
from boresight.cli import main
from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.settings import using
from boresight.sim.records.feed import Feeder, feed, feeds
from boresight.sim.records.files import content_of, read_pieces, read_record
from boresight.sim.records.record import Record, joined, resized, timed
from boresight.sim.records.selection import Selection
from tests.support.estimators import ALL


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """3,000 rows of 10 ms from 100 s on, a gap behind row 2,000, a slow sensor at every fifth."""
    t = 100.0 + 0.01 * np.arange(3000)
    t[2001:] += 0.5
    slow = np.where(np.arange(3000) % 5 == 2, np.arange(3000.0), np.nan)
    path = tmp_path / "log.csv"
    path.write_bytes(content_of(path, Record.of({"t": t, "x": np.arange(3000.0), "slow": slow})))
    return path


@pytest.mark.parametrize(
    "options",
    [
        {"start": "10s", "end": "12500ms"},
        {"start": 25},
        {"every": 4},
        {"start": "1", "end": "0.5min", "every": 7, "gaps": "restart"},
    ],
)
def test_pieces_are_the_rows_of_the_whole(log: Path, options) -> None:
    (every,) = read_pieces(log, 10_000)
    wanted = Selection.of(**options)
    with using(rows=wanted):
        one = read_record(log)
        for rows in (1, 7, 100_000):
            many = joined([*read_pieces(log, rows)])
            assert [*many.columns] == [*one.columns] and many.notes == one.notes
            for name, column in one.columns.items():
                assert np.array_equal(column.values, many.columns[name].values, equal_nan=True)
    t = every.columns["t"].values
    chosen = np.flatnonzero((t >= 100 + wanted.start_s) & (t < 100 + wanted.end_s))
    groups = chosen[: len(chosen) // wanted.every * wanted.every].reshape(-1, wanted.every)
    assert one.columns["x"].values.tolist() == groups[:, -1].tolist()
    dt = every.columns["dt"].values[groups]
    dt[0, 0] = every.columns["dt"].values[0]  # the median: a slice has no row before
    if wanted.gaps:
        dt[groups == 2001] = -0.25
        assert one.notes == (
            "gaps in the times, where the filter restarts: 1, the longest of 0.51 s",
        )
    summed = np.where((dt < 0).any(axis=1), -0.25, dt.sum(axis=1))
    assert one.columns["dt"].values == pytest.approx(summed)
    slow = [[x for x in group if x % 5 == 2][-1:] for group in groups.tolist()]
    held = one.columns["slow"].values
    assert [[] if np.isnan(x) else [x] for x in held.tolist()] == slow
    assert one.place(1, "x") == every.place(int(groups[1, -1]), "x")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from", "soon"], "--from: wanted a time such as 10s or 2min, found 'soon'"),
        (["--from", "5m"], "--from: wanted a time"),
        (["--from", "-1"], "--from: wanted 0 s or more"),
        (
            ["--from", "5", "--to", "4s"],
            "--to: wanted 0 s or more for --from, and a later time for --to, found 5 s and 4",
        ),
        (["--from", "1h"], "log.csv: wanted rows in the slice, 1 or more, found none; "),
        (["--every", "0"], "--every: wanted 1 or more"),
        (["--every", "5000"], "log.csv: wanted rows in the slice, 5000 or more, found too few; "),
        (
            ["--every", "9", "--from", "3550ms", "--to", "3.6s"],
            "wanted rows in the slice, 9 or more, found too few",
        ),
        (["--map", "any.toml"], "log.csv: wanted a recording"),
        (
            ["--gaps", "fill"],
            "--gaps: wanted one of refuse, restart, found 'fill'; choose one of "
            "these, or leave --gaps out: a gap is one long step then",
        ),
        (["--gaps", "refuse"], "line 2003, column t: wanted steps of at most 0.03 s"),
    ],
)
def test_what_is_refused(log: Path, tmp_path: Path, capsys, arguments, message: str) -> None:
    out = tmp_path / "out.csv"
    assert main(["run", str(log), "-o", str(out), *arguments]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line and not out.exists()


def test_a_log_is_converted_there_and_back(log: Path, tmp_path: Path, capsys) -> None:
    content = log.read_bytes()
    for suffix in (".csv.gz", ".parquet", ".npz", ".mat"):
        there, back = tmp_path / f"a{suffix}", tmp_path / "back.csv"
        assert main(["run", str(log), "-o", str(there)]) == 0
        assert main(["run", str(there), "-o", str(back)]) == 0
        assert back.read_bytes() == content, suffix
    assert "3,000 rows to" in capsys.readouterr().out
    assert main(["run", str(log)]) == main(["run", str(log), "-o", "out.bin"]) == 2


def test_times_of_pieces_rise_in_any_unit(tmp_path: Path) -> None:
    """As in one piece: the first row of a piece against the last of the piece before."""
    blocks = [Record.of({"t[ms]": np.arange(k, k + 2000.0)}) for k in (0.0, 1000.0)]
    with pytest.raises(InputError, match=r"wanted a time above 1999\.0 ms, .* found 1000\.0 ms"):
        [*timed(blocks)]


@pytest.mark.parametrize(("unit", "step"), [("s", 0.5), ("ms", 500.0), ("min", 1 / 120), ("", 0.5)])
def test_steps_of_times_are_in_the_unit_of_dt(unit: str, step: float) -> None:
    class Clocked(Estimator):
        inputs = (Input("dt", 0.0, 1000.0, unit),)
        states = ()
        outputs = (Output("dt_out", unit),)

        def step(self, x, u, p):
            return {}, {"dt_out": u.dt}

    log = Record.of({"t[ms]": np.arange(0.0, 5000.0, 500.0)})
    for record in (log, log.head(4), *timed([log])):
        assert feed(Clocked(), record).inputs[1:, 0] == pytest.approx(step)


def test_without_times_there_is_no_slice() -> None:
    with pytest.raises(InputError, match="wanted a column t, of which a slice is taken"):
        [*Selection.of(end=1.0).pieces([Record.of({"x": [1.0]})])]
    with pytest.raises(InputError, match="wanted a column t or dt, in which gaps are seen"):
        [*Selection.of(gaps="restart").pieces([Record.of({"x": [1.0]})])]


def test_a_gap_between_two_blocks() -> None:
    blocks = [Record.of({"t": [*t]}) for t in (np.arange(5) / 100.0, 1.0 + np.arange(5) / 100.0)]
    *_, last = Selection.of(gaps="restart").pieces(blocks)
    assert last.columns["dt"].values[0] == -0.25


def test_gaps_of_a_log_with_steps_alone() -> None:
    blocks = [Record.of({"dt": dt}) for dt in ([0.01] * 5, [0.01, 0.04, 0.02])]
    with pytest.raises(InputError, match=r"dt\[1\]: wanted steps of at most 0.03 s, .* of 0.04 s"):
        [*Selection.of(gaps="refuse").pieces(blocks)]
    *_, last = Selection.of(gaps="restart", every=2).pieces(blocks)
    assert last.columns["dt"].values.tolist() == pytest.approx([0.02, 0.02, 0.02, -0.25])
    assert last.notes == ("gaps in the times, where the filter restarts: 1, the longest of 0.04 s",)


class Sum(Estimator):
    """A sum of what it reads, for one time step."""

    inputs = (Input("z", -1.0, 1.0),)
    states = (State("sum", -8.0, 8.0),)
    outputs = (Output("sum"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"sum": x.sum + 0.01 * u.z}, {"sum": x.sum}


class TimedSum(Sum):
    inputs = (*Sum.inputs, Input("dt", 0.0, 100.0, "s"))


def test_longer_steps_of_an_estimator_that_does_not_see_them_are_told() -> None:
    t = np.arange(12) * 0.01
    even = Record.of({"t": t, "z": np.zeros(12)})
    torn = Record.of({"t": t + 0.3 * (t > 0.055), "z": np.zeros(12)})
    said = "gaps in the times: 1, longest 0.31 s: sum has no input dt, and counts"
    assert [text.partition(" each")[0] for text in feed(Sum(), torn).warnings] == [said]
    assert feed(Sum(), even).warnings == ()
    told = ("gaps in the times: 1, longest 0.31 s: timedsum takes each as one long step",)
    assert feed(TimedSum(), torn).warnings == told
    noted = replace(torn, notes=("gaps in the times: 1, longest 0.31 s",))  # of a recording
    assert feed(TimedSum(), noted).warnings == told
    with using(rows=Selection.of(every=4)):
        assert feed(Sum(), even).warnings == (
            "--every 4: sum has no input dt and no rates_hz, and counts 4 rows as one step",
        )
        assert feed(TimedSum(), even).warnings == ()


def test_gaps_of_all_pieces_are_counted() -> None:
    """A piece has the warnings of those before it."""
    t = np.arange(40) * 0.01 + 30.0 * (np.arange(40) > 15) + 2.0 * (np.arange(40) > 32)
    pieces = resized(timed([Record.of({"t": t, "z": np.zeros(40)})]), 10)
    told = [piece.warnings for piece in feeds(TimedSum(), pieces)]
    once, twice = (
        f"gaps in the times: {k}, longest 30 s: timedsum takes each as one long step"
        for k in (1, 2)
    )
    assert told == [(), (once,), (once,), (twice,)]


def test_gaps_restart_what_restarts() -> None:
    record, mekf = Record.of({"dt": [-0.25]}), estimator("mekf")
    with using(rows=Selection.of(gaps="restart")):
        Feeder(mekf)
        mekf.restarts = False
        with pytest.raises(InputError, match="^--gaps restart: wanted an estimator .* found mekf;"):
            feed(mekf, record)


@pytest.mark.parametrize("name", ALL)
def test_a_step_below_0_restarts_ours(name: str) -> None:
    e = ALL[name]()
    assert e.restarts == any(i.name == "dt" and i.low < 0.0 for i in e.inputs)


def test_a_gap_is_told_to_a_filter_as_on_a_board() -> None:
    """Up to 0.24 s beyond its range by its length, below zero; a longer one as a restart."""

    class Restarting(Sum):
        restarts = True
        inputs = (Input("dt", -0.25, 0.25, "s", clamp=True), *Sum.inputs)

    t = np.cumsum([0.01, 0.01, 0.01, 0.35, 0.01, 30.0, 0.25, 0.01, 0.01])
    result = feed(Restarting(), Record.of({"t": t, "z": np.zeros(9)}))
    assert result.inputs[3:7, 0] == pytest.approx([0.25 - 0.35, 0.01, -0.24, 0.25])
    assert result.warnings == (
        "gaps in the times: 3, longest 30 s: restarting restarts after those above 0.25 s",
    )


@pytest.mark.parametrize(
    "gap, does",
    [(0.44, "bridges those above 0.2499 s"), (0.46, "restarts after those above 0.45 s")],
)
def test_mekf_bridges_a_gap_or_restarts(gap: float, does: str) -> None:
    t = np.cumsum([0.01, 0.01, 0.01, gap, 0.01])
    mekf = estimator("mekf")
    ones = {i.name: np.ones(5) for i in mekf.inputs if i.name != "dt"}
    result = feed(mekf, Record.of({"t": t, **ones}))
    assert f"gaps in the times: 1, longest {gap:.3g} s: mekf {does}" in result.warnings


class ShortSteps(Sum):
    inputs = (*Sum.inputs, Input("dt", 0.0, 0.1, "s"))


@pytest.mark.parametrize("every", [1, 2])
@pytest.mark.parametrize("kind", ["s", "ms", "single", "late"])
def test_a_step_at_its_limit(kind: str, every: int) -> None:
    """A difference of times has their rounding: 0.4 - 0.3 is above 0.1."""
    t = np.arange(200) * (0.1 / every) + (1e6 if kind == "late" else 0.0)
    times = {"s": t.round(2), "late": t, "ms": t * 1e3, "single": t.astype(np.float32)}[kind]
    head = "t[ms]" if kind == "ms" else "t"
    with using(rows=Selection.of(every=every)):
        blocks = [Record.of({head: times, "z": np.zeros(200)})]
        record = joined([*Selection.of(every=every).pieces(timed(blocks))])
        result = feed(ShortSteps(), record)
        assert result.inputs[:, 1].max() == 0.1 and result.warnings == ()
        longer = times.copy()
        longer[100:] += 1e-4 * (1e3 if kind == "ms" else 1.0)
        blocks = [Record.of({head: longer, "z": np.zeros(200)})]
        record = joined([*Selection.of(every=every).pieces(timed(blocks))])
        with pytest.raises(InputError, match="found 0.1001"):
            feed(ShortSteps(), record)


def test_times_that_single_precision_holds_too_are_exact() -> None:
    t = 1e5 + 0.109375 * np.arange(20)
    with pytest.raises(InputError, match="found 0.109375"):
        feed(ShortSteps(), Record.of({"t": t, "z": np.zeros(20)}))


def test_a_column_of_steps_at_the_limit() -> None:
    result = feed(ShortSteps(), Record.of({"dt": [0.1] * 5, "z": [0.0] * 5}))
    assert result.warnings == () and result.inputs[:, 1].tolist() == [0.1] * 5


def test_rows_behind_a_gap_are_run_from_the_time_of_the_first() -> None:
    t = np.concatenate([np.arange(0.0, 15.0, 0.01), np.arange(15.4, 20.0, 0.01)])
    blocks = [Record.of({"t": t, "z": np.zeros(len(t))})]
    for start in (15.2, 15.4):
        (record,) = Selection.of(start=start).pieces(timed(blocks))
        assert record.columns["t"].values[0] == 15.4
        assert feed(ShortSteps(), record).inputs[:, 1] == pytest.approx(np.full(460, 0.01))


def test_a_slice_begins_at_the_first_sample_of_what_is_held() -> None:
    class Held(Sum):
        inputs = (Input("z", -1.0, 1.0, missing="hold"),)

    with using(rows=Selection.of(start=0.01)):
        result = feed(Held(), Record.of({"t": [0.01, 0.02, 0.03], "z": [np.nan, 0.5, np.nan]}))
    assert result.inputs.tolist() == [[0.5], [0.5]]
    assert result.warnings == ("z: no sample at the start of the slice; rows left out: 1",)
