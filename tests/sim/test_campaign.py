"""The journal: what was added is there whenever a process dies, another's file is left alone."""

import os
import signal
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing

import pytest

from boresight.model.errors import InputError
from boresight.sim.campaign import Journal, complete


def test_goes_on(tmp_path) -> None:
    path = tmp_path / "new" / "j"
    Journal(path, {"a": 1})
    assert not path.parent.exists(), "nothing before the first draw"
    Journal(path, {"a": 1}).add([{"seed": 3, "x": 0.1}, {"seed": 4, "x": 1 / 3}])
    again = Journal(path, {"a": 1})
    assert again.rows == {3: {"seed": 3, "x": 0.1}, 4: {"seed": 4, "x": 1 / 3}}
    again.add([{"seed": 4, "x": 2.0}])
    assert Journal(path, {"a": 1}).rows[4] == {"seed": 4, "x": 2.0}


#: Adds rows one by one and says so of each, until it is killed.
ADDER = """
import itertools, sys
from pathlib import Path
from boresight.sim.campaign import Journal
journal = Journal(Path(sys.argv[1]), {"a": 1}, key="name")
for k in itertools.count(len(journal.rows)):
    journal.add([{"name": f"row {k}", "k": k, "text": "x" * 20_000}])
    print(k, flush=True)
"""


def test_a_killed_process_loses_no_row_that_it_has_told(tmp_path) -> None:
    told = -1
    for lines in (1, 4, 2):
        adder = subprocess.Popen(
            [sys.executable, "-c", ADDER, str(tmp_path / "j")], stdout=subprocess.PIPE, text=True
        )
        assert adder.stdout is not None
        for _ in range(lines):
            told = int(adder.stdout.readline())
        os.kill(adder.pid, signal.SIGKILL)
        rest = adder.communicate()[0].split()
        told = int(rest[-1]) if rest else told
        done = Journal(tmp_path / "j", {"a": 1}, key="name").rows
        assert len(done) in (told + 1, told + 2)  # one more may be whole and untold
        assert all(done[f"row {k}"]["k"] == k for k in range(len(done)))


def test_two_at_once(tmp_path) -> None:
    def add(first: int) -> None:
        journal = Journal(tmp_path / "j", {"a": 1})
        for k in range(first, first + 20):
            journal.add([{"seed": k}])

    threads = [threading.Thread(target=add, args=(first,)) for first in (0, 10, 100)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {*Journal(tmp_path / "j", {"a": 1}).rows} == {*range(30), *range(100, 120)}


@pytest.mark.parametrize("kind", ["text", "other", "base"])
def test_of_another(tmp_path, kind) -> None:
    path = tmp_path / "j"
    if kind == "text":
        path.write_text("something\n")
    elif kind == "other":
        Journal(path, {"a": 2}).add([{"seed": 1}])
    else:
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("CREATE TABLE campaign (a)")
    before, late = path.read_bytes(), Journal(tmp_path / "none", {"a": 1})
    with pytest.raises(InputError, match="wanted the journal of this campaign"):
        Journal(path, {"a": 1})
    if kind != "base":
        late.path = path
        with pytest.raises(InputError, match="wanted the journal of this campaign"):
            late.add([{"seed": 2}])
    assert path.read_bytes() == before


def test_cannot_be_read_or_written(tmp_path) -> None:
    with pytest.raises(InputError, match="wanted a journal that can be read and written"):
        Journal(tmp_path, {"a": 1})
    path = tmp_path / "j"
    journal = Journal(path, {"a": 1})
    journal.add([{"seed": 1}])
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("INSERT INTO runs VALUES (2, 'broken')")
    with pytest.raises(InputError, match="wanted a journal that can be read and written"):
        Journal(path, {"a": 1})
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match="wanted a journal that can be read and written"):
        journal.add([{"seed": 3}])
    assert 3 not in journal.rows


def work(campaign, cases):
    return [{"seed": case, "refused": "no" if case == campaign else ""} for case in cases]


def test_progress_has_done_refused_and_left(tmp_path) -> None:
    said: list[str] = []
    seen: list[int] = []
    journal = Journal(tmp_path / "j", {})
    journal.add([{"seed": 7}])
    cases = {k: k for k in (2, 7, 1)}
    rows = complete(
        1, work, cases, journal, say=said.append, after_batch=lambda: seen.append(len(journal.rows))
    )
    assert [row["seed"] for row in rows] == [2, 7, 1] and seen == [2, 3]
    assert said[0] == "1 of 3 runs are done already" and said[2] == "3 of 3 runs, 1 refused"
    assert said[1].startswith("2 of 3 runs, about ") and said[1].endswith(" s left")
