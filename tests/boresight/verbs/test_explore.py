"""`boresight explore`: a row for each combination, nothing twice, whoever measures."""

from __future__ import annotations

import json
import shlex

import pytest

import boresight
from boresight.cli import main
from boresight.sim.explore.measure import measured

SOURCE = """
from boresight import Estimator, Input, Output, State


class Smooth(Estimator):
    inputs = (Input("a", -1.0, 1.0, "V"),)
    states = (State("m", -1.0, 1.0, "V"),)
    outputs = (Output("m", "V", tolerance=1e-3),)

    def __init__(self, shift=3):
        if shift < 0:
            raise ValueError("negative shift")
        self.gain = 2.0**-shift

    def step(self, x, u, p):
        m = (1.0 - self.gain) * x.m + self.gain * u.a
        return {"m": m}, {"m": m}
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "smooth.py").write_text(SOURCE)
    rows = (f"{(k * 7 % 11) / 11 - 0.4}" for k in range(30))
    (tmp_path / "log.csv").write_text("a\n" + "\n".join(rows) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


WORDS = ("--words", "18,32", "--no-area")


def test_rows_choice_and_files(here, capsys) -> None:
    line = ["explore", "smooth.py", "log.csv", "shift=3,-1", *WORDS, "--jobs", "1"]
    line += ["--csv", "t.csv", "--parquet", "t.parquet"]
    assert main([*line, "--want", "m<1uV", "--least", "cycles"]) == 0
    out, err = capsys.readouterr()
    assert "choice, cycles " in out and "cycles 10: shift=3, 32 bits, small" in out.splitlines()[-2]
    assert out.count("negative shift") == 4 and "8 combinations" in err
    head, *rows = (here / "t.csv").read_text().splitlines()
    assert head.startswith("estimator,word[bits],config,target,m[V],m.rms[V],") and len(rows) == 8
    from pyarrow import parquet

    table = parquet.read_table(here / "t.parquet")
    assert table.column_names == [cell.partition("[")[0] for cell in head.split(",")]
    assert table["word"].to_pylist() == 2 * [18, 32, 18, 32]
    page = (here / "build" / "explore-smooth.html").read_text()
    assert "boresight compile" in page and '"left": 0' in page
    assert main([*line, "--want", "m<1uV, cycles<3", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["choice"]["row"] is None and data["choice"]["missed"] == ["cycles<3"]
    assert len(data["rows"]) == 8 and data["good"] is False


def test_nothing_is_measured_twice_and_a_cut_loses_no_row(here, monkeypatch) -> None:
    kinds: list[str] = []

    def some(exploration, tasks):
        if len(kinds) == 3:
            raise KeyboardInterrupt
        kinds.extend(task.kind for task in tasks)
        return measured(exploration, tasks)

    def run(words=(18, 32), **more):
        return boresight.explore("smooth.py", "log.csv", words=words, area=False, jobs=1, **more)

    monkeypatch.setattr("boresight.verbs.explore.measured", some)
    with pytest.raises(KeyboardInterrupt):
        run()
    assert '"left": 3' in (here / "build" / "explore-smooth.html").read_text()
    del kinds[:]
    first = run()
    assert kinds == 3 * ["cycles"]
    del kinds[:]
    assert run() == first and run(words=(32,))[0] == first[1] and not kinds
    assert run(words=(20,)) != first and kinds == ["errors", "cycles", "cycles"]


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_what_the_check_that_follows_is_given(here, jobs, capsys) -> None:
    """Tolerances, rows and urgent outputs, in every process and in the commands."""
    given = ("--tolerance", "m=1e-9V", "--every", "2", "--urgent", "1", "--jobs", jobs)
    assert main(["explore", "smooth.py", "log.csv", *WORDS, *given, "--json"]) == 0
    narrow, row, *_ = json.loads(capsys.readouterr().out)["rows"]
    assert "wanted a last bit of at most 1e-09, for the tolerance of output m" in narrow["refused"]
    thin = [(k * 7 % 11) / 11 - 0.4 for k in range(1, 30, 2)]
    alone = boresight.explore("smooth.py", {"a": thin}, words=(32,), area=False, jobs=1, output="b")
    largest = alone[0].errors["m"].largest
    assert row["errors"]["m"]["largest"] == largest
    assert row["figures"]["tolerance"] == pytest.approx(largest / 1e-9)
    made, checked, _ = row["commands"]
    assert " --urgent 1 --tolerance m=1e-9V " in made and checked.endswith("m=1e-9V --every 2")
    assert main([*shlex.split(checked)[1:], "--levels", "fixed"]) == 0


def test_a_table_for_notebooks(here) -> None:
    result = boresight.explore("smooth.py", {"a": [0.1, 0.2]}, words=(18, 32), area=False, jobs=1)
    columns = result.columns
    assert columns["word"] == [18, 32, 18, 32] and len({*map(len, columns.values())}) == 1
    assert columns["m"][0] > columns["m"][1] > 0.0 and result[1].errors["m"].unit == "V"
    assert "<table>" in result._repr_html_() and "fast" in result._repr_html_()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--want", "mm<1"], "want: wanted one of 20 names, nearest: m, "),
        (["--least", "size"], "least: wanted one of"),
        (["--words", "18,x"], "words: wanted whole numbers"),
        (["--words", "40"], "word"),
        (["--config", "large"], "config: wanted one of small"),
        (["--target", "xc7"], " names, nearest: xc6slx"),
        (["--want", "lut<500"], "no-area: wanted areas and clocks, for lut, found --no-area; "),
        (["--route"], "route: wanted a target that an open tool routes, found --target xc6slx9"),
        (["--toggles", "--target", "ice40-up5k"], "toggles: wanted a target whose netlist is"),
        (["--seeds", "2"], "seeds: wanted cores that are routed"),
        (["--clock", "0"], "clock: wanted 1 to 10,000"),
        (["--csv", "build/explore-smooth.html"], "wanted a file of its own"),
        (["shift=-1"], "negative shift"),
    ],
)
def test_bad_input_is_one_line(here, more, message, capsys) -> None:
    assert main(["explore", "smooth.py", "log.csv", *more, "--no-area"]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1
    assert not (here / "build").exists()


def test_bad_logs_and_a_foreign_table(here, capsys) -> None:
    assert main(["explore", "smooth.py", "shift=3", "--no-area"]) == 2
    assert "wanted at least one log" in capsys.readouterr().err
    (here / "b.csv").write_text("b\n1\n")
    assert main(["explore", "smooth.py", "b.csv", "--no-area"]) == 2
    assert "wanted a column a" in capsys.readouterr().err
    (here / "build").mkdir()
    (here / "build" / "explore-smooth.jsonl").write_text("mine")
    assert main(["explore", "smooth.py", "log.csv", *WORDS]) == 2
    assert "wanted a journal that can be read and written" in capsys.readouterr().err
