"""The executor, and the journal of what it computed."""

import os
import signal
import sys
from pathlib import Path

import pytest

from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.external import ToolFailed
from boresight.sim import campaign
from boresight.sim.campaign import Journal, cluster, complete, dispatch


def square(x: int) -> int:
    if x < 0:
        raise ValueError("below zero")
    return x * x


def end(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_and_errors_of_tasks(jobs: int) -> None:
    tasks = [(str(x), square, (x,)) for x in range(7)]
    assert dict(dispatch(jobs, tasks)) == {str(x): x * x for x in range(7)}
    with pytest.raises(ValueError, match="below zero"):
        dict(dispatch(jobs, [("a", square, (2,)), ("b", square, (-1,))]))


def test_a_killed_process_is_an_error_of_one_line() -> None:
    with pytest.raises(ToolFailed, match="a worker process ended before its task"):
        dict(dispatch(2, [("a", end, (1,)), ("b", square, (1,))]))


def test_a_journal_keeps_rows_and_ignores_a_line_that_was_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "new" / "j.jsonl"
    Journal(path).add({"a": {"x": 0.1}, "b": {"x": 1 / 3}})
    with path.open("a") as file:
        file.write('{"key": "c", "x"')
    journal = Journal(path)
    assert journal.rows == {"a": {"x": 0.1}, "b": {"x": 1 / 3}}
    journal.add({"b": {"x": 2.0}})
    assert Journal(path).rows == {"a": {"x": 0.1}, "b": {"x": 2.0}}
    assert not Journal(path, again=True).rows


def test_a_file_that_is_not_a_journal_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "notes"
    for text in ("something\n", '{"a": 1}\n', "[1]\n"):
        path.write_text(text)
        with pytest.raises(InputError, match="wanted a journal that can be read and written"):
            Journal(path)
        assert path.read_text() == text
    os.truncate(path, 0)
    os.truncate(path, 1 << 40)  # zeros without end, a pipe, a device
    os.mkfifo(tmp_path / "pipe")
    for other in (path, tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InputError, match="wanted a journal"):
            Journal(other)
    path.unlink()
    journal = Journal(tmp_path / "new")
    journal.path.mkdir()
    with pytest.raises(InputError, match="/new: wanted a journal that can be read and written"):
        journal.add({"a": {}})


def work(refused: int, tasks: list[int]) -> list[dict[str, object]]:
    return [{"task": task, "refused": "no" * (task == refused)} for task in tasks]


def test_only_new_tasks_run(tmp_path: Path) -> None:
    said: list[str] = []
    journal = Journal(tmp_path / "j")
    journal.add({"7": {"task": 7}})
    rows = complete(1, work, {str(k): k for k in (2, 7, 1)}, journal, say=said.append)
    assert [row["task"] for row in rows] == [2, 7, 1]
    assert said[0].startswith("1 of 3 runs are in ") and said[-1] == "3 of 3 runs, 1 refused"


def test_without_dask_one_line_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ToolMissing, match="pip install 'boresight"), cluster("tcp://here:8786"):
        pass


@pytest.mark.filterwarnings("ignore")
def test_workers_of_a_cluster() -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as here,
        cluster(here.scheduler_address) as executor,
    ):
        results = dict(dispatch(1, [(x, square, (x,)) for x in range(5)], executor))
    assert results == {x: x * x for x in range(5)}


def test_rows_of_other_sources_have_another_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    before = campaign.sources(square)
    assert campaign.sources(square) == before
    monkeypatch.setattr(campaign, "package_digest", lambda: "other")
    assert campaign.sources(square) != before
