"""Slices, every n-th row and gaps: the same rows in one piece and in many."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.records.files import content_of, read_pieces, read_record
from boresight.sim.records.record import Record, joined
from boresight.sim.records.selection import Selection, selected


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
    with selected(wanted):
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
        (["--from", "5", "--to", "4s"], "--to: wanted a time above --from, 5 s, found 4 s"),
        (["--from", "1h"], "log.csv: wanted rows from 3600 s"),
        (["--every", "0"], "--every: wanted 1 or more"),
        (["--gaps", "fill"], "--gaps: wanted one of refuse, bridge, restart"),
        (["--gaps", "refuse"], "line 2003, column t: wanted steps of at most 0.03 s"),
    ],
)
def test_what_is_refused(log: Path, tmp_path: Path, capsys, arguments, message: str) -> None:
    out = tmp_path / "out.csv"
    assert main(["convert", str(log), "-o", str(out), *arguments]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line and not out.exists()


def test_a_log_is_converted_there_and_back(log: Path, tmp_path: Path, capsys) -> None:
    content = log.read_bytes()
    for suffix in (".csv.gz", ".parquet", ".npz", ".feather", ".mat"):
        there, back = tmp_path / f"a{suffix}", tmp_path / "back.csv"
        assert main(["convert", str(log), "-o", str(there)]) == 0
        assert main(["convert", str(there), "-o", str(back)]) == 0
        assert back.read_bytes() == content, suffix
    assert "3,000 rows to" in capsys.readouterr().out
    assert main(["convert", str(log)]) == main(["convert", str(log), "-o", "out.bin"]) == 2


def test_without_times_there_is_no_slice() -> None:
    with pytest.raises(InputError, match="wanted a column t"):
        [*Selection.of(end=1.0).pieces([Record.of({"x": [1.0]})])]
