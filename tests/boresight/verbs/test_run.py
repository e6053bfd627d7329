"""`boresight run`: what it gives, what it writes, and what it refuses."""

from __future__ import annotations

import importlib
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output, State
from boresight.cli import main
from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.sim.levels.integer import Emitted
from boresight.sim.records import text
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import content_of, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.accuracy import attitude_rmse

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.run")

SYNTHETIC = bundled("synthetic_60s")

MINE = """
from boresight import Estimator, Input, Output, Param, State


class Mine(Estimator):
    inputs = (Input("z", -4.0, 4.0, "m", clamp=True), Input("dt", 0.0, 1.0, "s"))
    params = (Param("k", 0.5, 0.0, 1.0),)
    states = (State("x", -8.0, 8.0, "m", 1.0),)
    outputs = (Output("x", "m"), Output("h", "ht"), Output("s", "flags"))

    def step(self, x, u, p):
        y = x.x + p.k * (u.z - x.x)
        return {"x": y}, {"x": y, "h": 0.125 * u.z, "s": u.dt + u.dt}
"""
LOG = "t[ms],z[cm],x_true,h_true[deg]\n0,200,1.5,45\n500,-100,,\n1000,900,2.0,90\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "log.csv").write_text(LOG)
    return tmp_path


@pytest.mark.parametrize("on", ["float", "numpy", "fixed", "c"])
def test_by_hand(here: Path, on: str) -> None:
    data = boresight.run("mine.py", "log.csv", on=on, output="out.csv")
    x, h = [1.5, 0.25, 2.125], [0.25, -0.125, 0.5]
    assert (data.estimator, data.on, data.log) == ("mine", on, "log")
    assert data.t.tolist() == [0.0, 0.5, 1.0]
    assert np.abs(data.outputs["x"] - x).max() < 1e-8
    assert np.abs(data.outputs["h"] - h).max() < 1e-8
    assert data.outputs["s"].tolist() == [1.0, 1.0, 1.0]
    assert data.units == {"x": "m", "h": "ht", "s": "flags"}
    assert data.warnings == () and data.clamped == {"z": 1}
    assert [(d.output, d.samples) for d in data.truth] == [("x", 2), ("h", 2)]
    assert data.truth[0].largest == pytest.approx(0.125, abs=1e-8)
    assert all(d.tolerance is None for d in data.truth)
    assert data.attitude is None and "q" not in data.to_json()
    # What it wrote is a log itself, half turns in degrees.
    out = read_record("out.csv")
    assert {n: c.unit for n, c in out.columns.items()} == {
        "t": "s", "x": "m", "h": "deg", "s": "flags"
    }  # fmt: skip
    assert out.columns["t"].values.tolist() == [0.0, 0.5, 1.0]
    again = data.record()
    assert {n: c.unit for n, c in again.columns.items()} == {
        n: c.unit for n, c in out.columns.items()
    }
    page = data._repr_html_()  # a plot for each unit
    assert f"mine on {on}: 3 rows, RMSE against the log" in page and page.count("<svg") == 1
    assert all(f">{text}<" in page for text in ("x", "h", "s", "m", "ht", "t, s"))
    assert np.array_equal(out.columns["x"].values, data.outputs["x"])
    assert np.array_equal(out.columns["h"].values, 180.0 * data.outputs["h"])


@pytest.mark.parametrize(
    ("name", "on"), [("mekf", "c"), ("vqf", "float"), ("complementary", "fixed")]
)
def test_pieces_of_any_length_give_the_same_bytes(
    here: Path, name: str, on: str, monkeypatch
) -> None:
    whole = boresight.run(name, SYNTHETIC, on=on, steps=2500, output="whole.csv")
    for rows, steps in ((1, 30), (7, 500), (1000, 2500), (1_000_000, 2500)):
        monkeypatch.setattr(text, "_BLOCK", 1 << 14)  # several of them in the file
        pieces = boresight.run(name, SYNTHETIC, on=on, steps=steps, output="out.csv", rows=rows)
        assert len(pieces) == steps and not pieces.outputs and not len(pieces.attitude.q)
        lines = Path("whole.csv").read_bytes().splitlines(keepends=True)
        assert Path("out.csv").read_bytes() == b"".join(lines[: steps + 1]), rows
    assert str(pieces) == str(whole) and pieces.attitude.samples == 2500
    assert pieces.truth == () and len(whole.truth) == 5  # its error says it
    parts = (pieces.attitude.q, pieces.attitude.euler_deg, pieces.attitude.status)
    assert {(len(x), x.base is None or not x.base.size) for x in parts} == {(0, True)}  # no rows


def test_truth_of_pieces(here: Path) -> None:
    t = 0.01 * np.arange(60)
    truth = np.where(t > 0.3, np.nan, 2.0 * np.cos(t))
    columns = {"t": t, "z": np.sin(t), "x_true": truth, "h_true[deg]": 100.0 * t}
    (here / "long.csv").write_bytes(content_of("long.csv", Record.of(columns)))
    whole = boresight.run("mine.py", "long.csv", on="c")
    pieces = boresight.run("mine.py", "long.csv", on="c", rows=7)
    for one, other in zip(pieces.truth, whole.truth, strict=True):
        assert (one.samples, one.at_step, one.largest) == (
            other.samples, other.at_step, other.largest
        )  # fmt: skip
        assert one.rms == pytest.approx(other.rms, rel=1e-12) and not one.apart.size
    assert [d.samples for d in pieces.truth] == [31, 60]


@pytest.mark.parametrize("out", ["a.csv.gz", "a.csv.zst", "a.parquet", "a.feather"])
def test_every_kind_of_log_in_pieces(here: Path, out: str) -> None:
    source = f"log{out[1:]}"
    Path(source).write_bytes(content_of(source, read_record(SYNTHETIC)))
    for rows, name in ((None, f"w{out}"), (1000, f"p{out}")):
        boresight.run("complementary", source, on="c", output=name, rows=rows)
    assert Path(f"w{out}").read_bytes() == Path(f"p{out}").read_bytes()
    boresight.run("complementary", SYNTHETIC, on="c", output="text.csv")
    wanted, found = read_record("text.csv").columns, read_record(f"p{out}").columns
    assert list(found) == list(wanted)
    assert all(found[n].values.tobytes() == wanted[n].values.tobytes() for n in wanted)


def test_a_fault_in_a_later_piece_leaves_nothing(here: Path, monkeypatch) -> None:
    monkeypatch.setattr(text, "_BLOCK", 1 << 14)
    lines = Path(SYNTHETIC).read_text().splitlines()
    for bad, wrong in (("5000.x", "line 5001, column t: wanted a finite number"),
                       ("0.5", "line 5001, column t: wanted a time above")):  # fmt: skip
        rest = lines[5000].partition(",")[2]
        Path("bad.csv").write_text("\n".join([*lines[:5000], f"{bad},{rest}", *lines[5001:]]))
        with pytest.raises(InputError, match=wrong):
            boresight.run("complementary", "bad.csv", on="c", output="out.csv", rows=100)
        assert sorted(p.name for p in here.iterdir() if p.name.startswith(("out", ".bore"))) == []
    monkeypatch.setattr(module, "_ROWS", 100)
    assert main(["run", "complementary", "bad.csv", "--on", "c"]) == 2


class Diverging(Estimator):
    """Doubles its state."""

    inputs = (Input("a", 0.0, 1.0),)
    states = (State("s", -100.0, 100.0),)
    outputs = (Output("s"),)

    def step(self, x, u, p):
        s = 2.0 * x.s + u.a
        return {"s": s}, {"s": s}


def test_an_estimator_that_diverges_is_named_with_its_step(here: Path) -> None:
    Path("ones.csv").write_text("t,a\n" + "".join(f"{k},1\n" for k in range(1200)))
    step = r"^diverging, output s, step 1023: .*diverges; --steps 1023 gives the rows before it$"
    for rows in (None, 500):
        with pytest.raises(InputError, match=step):
            boresight.run(Diverging, "ones.csv", on="numpy", output="out.csv", rows=rows)
        assert not Path("out.csv").exists()
    assert len(boresight.run(Diverging, "ones.csv", on="numpy", output="out.csv", steps=1023))


@pytest.mark.parametrize("name", ["out.xlsx", "out.json"])
def test_a_log_is_not_written_under_the_suffix_of_another_kind(here: Path, name: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(name)}: wanted a suffix of a log"):
        boresight.run(Diverging, "none.csv", output=name)


def test_gaps_of_later_pieces_are_told(here: Path, capsys) -> None:
    """They are counted at the end, the other warnings at the begin."""
    t = 0.01 * np.arange(40_000) + np.where(np.arange(40_000) > 39_000, 0.06, 0.0)
    (here / "long.csv").write_bytes(content_of("long.csv", Record.of({"t": t, "z": 0.0 * t})))
    assert main(["run", "mine.py", "long.csv", "--on", "c", "--gaps", "bridge"]) == 0
    said = capsys.readouterr().err
    assert "warning: gaps in the times, bridged: 1, the longest of 0.07 s" in said


def test_parameters_steps_and_widths(here: Path) -> None:
    still = boresight.run("mine.py", "log.csv", params={"k": 0.0}, steps=2)
    assert still.outputs["x"].tolist() == [1.0, 1.0] and len(still.t) == 2
    third = {"k": 1.0 / 3.0}
    words = [
        boresight.run("mine.py", "log.csv", params=third, word=w).outputs["x"] for w in (18, 32)
    ]
    assert 1e-6 < np.abs(words[0] - words[1]).max() < 1e-3


def test_data_in_memory() -> None:
    class Mine(boresight.Estimator):
        inputs = (boresight.Input("z", -4.0, 4.0, "m"),)
        outputs = (boresight.Output("y", ""),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": u.z + 1.0}

    for source in (Mine, Mine()):
        data = boresight.run(source, {"z[cm]": [100.0, -50.0]})
        assert data.outputs["y"].tolist() == [2.0, 0.5]
        assert data.t is None and data.truth == ()


def test_a_record_without_times_or_units_is_written_without(here: Path) -> None:
    boresight.run("mine.py", {"z": [0.5], "dt": [0.25]}, on="numpy", output="out.csv")
    assert Path("out.csv").read_text() == "x[m],h[deg],s[flags]\n0.75,11.25,0.5\n"


def test_attitudes() -> None:
    log, filter = read_record(SYNTHETIC), estimator("complementary")
    data = boresight.run("complementary", SYNTHETIC, on="float", steps=200)
    inputs = feed(filter, log).inputs[:200]
    reference = filter.run_float(inputs[:, :, None]).outputs
    q = np.stack([reference[n][:, 0] for n in ("qw", "qx", "qy", "qz")], axis=1)
    assert np.abs(data.attitude.q - q).max() < 1e-9
    heading = 180.0 * reference["heading"][:, 0]
    assert np.abs((data.attitude.euler_deg[:, 0] - heading + 180) % 360 - 180).max() < 1e-7
    assert data.attitude.status.dtype == np.int64
    assert data.attitude.status.tolist() == reference["status"][:, 0].tolist()
    rmse = attitude_rmse(data.attitude.q, NineAxis.of(log).attitude[:200], None)._asdict()
    assert data.attitude.rmse_deg._asdict() == pytest.approx(rmse)
    assert data.warnings == ()


def test_a_log_in_memory_is_the_file(tmp_path: Path) -> None:
    """A column ``mov`` says which samples count."""
    log = read_record(SYNTHETIC)
    view = NineAxis.of(log)
    mov = np.arange(len(log)) >= 40
    for source in (log, SYNTHETIC):
        assert (
            boresight.run("complementary", source, on="c", steps=90).attitude.rmse_deg is not None
        )
    first, other = (
        boresight.run("complementary", source, on="c", steps=90).outputs
        for source in (log, SYNTHETIC)
    )
    assert all(np.array_equal(first[n], other[n]) for n in first)
    data = boresight.run("complementary", replace(view, mov=mov).record(), on="c", steps=90)
    assert data.attitude.rmse_deg._asdict() == pytest.approx(
        attitude_rmse(data.attitude.q, view.attitude[:90], mov[:90])._asdict()
    )
    assert data.attitude.rmse_deg._asdict() != pytest.approx(
        boresight.run("complementary", log, on="c", steps=90).attitude.rmse_deg._asdict()
    )


def test_leading_steps_are_those_of_the_whole_log(here: Path) -> None:
    """The first time step is the median over the log, however few rows run."""
    t = np.array([0.0, 0.5, 0.6, 0.7, 0.8])
    whole = boresight.run("mine.py", {"t": t, "z": np.zeros(5)}, on="numpy")
    for steps in (1, 2, 4):
        part = boresight.run("mine.py", {"t": t, "z": np.zeros(5)}, on="numpy", steps=steps)
        for name, values in part.outputs.items():
            assert values.tolist() == whole.outputs[name][:steps].tolist()


def test_an_output_named_as_the_time_is_refused_before_the_work(here: Path) -> None:
    (here / "timer.py").write_text(
        MINE.replace('Output("x"', 'Output("t"').replace('{"x": y, "h"', '{"t": y, "h"')
    )
    message = "mine, output t: wanted another name for what is written, found t, the column of the"
    with pytest.raises(boresight.InputError, match=f"^{message}"):
        boresight.run("timer.py", {"t": [0.0, 0.25], "z": [0.5, 0.5]}, output="out.csv")
    assert not (here / "out.csv").exists()


def test_an_archive_by_its_name(here: Path) -> None:
    columns = {"t": [0.0, 0.25], "z": [0.5, 0.25]}
    for name in ("out.csv", "out.npz"):
        boresight.run("mine.py", columns, on="c", output=name)
    first, other = (boresight.record_of(name) for name in ("out.csv", "out.npz"))
    assert (here / "out.npz").read_bytes().startswith(b"PK") and list(first.columns) == list(
        other.columns
    )
    for name, column in first.columns.items():
        assert column.values.tolist() == other.columns[name].values.tolist()


def test_attitudes_without_truth() -> None:
    columns = read_record(SYNTHETIC).head(30).columns
    source = {n: c.values for n, c in columns.items() if not n.startswith("q")}
    data = boresight.run("mekf", source, on="c")
    assert data.attitude.rmse_deg is None and data.truth == ()
    assert data.attitude.q.shape == (30, 4) and data.attitude.euler_deg.shape == (30, 3)


def test_a_reference_without_numbers(here: Path) -> None:
    columns = {n: c.values.copy() for n, c in read_record(SYNTHETIC).head(30).columns.items()}
    columns |= dict.fromkeys(("qw", "qx", "qy", "qz"), np.full(30, np.nan))
    for rows in (None, 10):
        data = boresight.run("complementary", columns, on="c", output="out.csv", rows=rows)
        assert data.attitude.rmse_deg is None and data.attitude.samples == 0
        assert str(data) == "30 rows" and Path("out.csv").exists()


def test_command_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "mine.py", "log.csv", "--param", "k=0.5"]) == 0
    assert capsys.readouterr().out == (
        "3 rows to mine-fixed.csv, RMSE against the log's truth: x 0.08839 m, h 0 ht\n"
    )
    assert Path("mine-fixed.csv").read_text().startswith("t[s],x[m],h[deg],s[flags]\n0.0,1.5,")
    assert main(["run", "mine.py", "log.csv", "--json", "--steps", "2"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["t"] == [0.0, 0.5] and data["outputs"]["s"] == [1.0, 1.0]
    assert data["truth"][1]["output"] == "h"
    assert sorted(p.name for p in here.glob("*.csv")) == ["log.csv", "mine-fixed.csv"]


def test_command_line_of_an_attitude(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["run", "complementary", str(SYNTHETIC), "--on", "c", "--steps", "50", "-o", "a.csv"]
    assert main(line) == 0
    captured = capsys.readouterr()
    assert re.fullmatch(
        r"50 rows to a\.csv, RMSE against the log's reference, deg: (\w+ \d+\.\d{3}(, )?)+\n",
        captured.out,
    )
    assert captured.err == ""
    assert len(Path("a.csv").read_text().splitlines()) == 51


def test_warnings_go_to_standard_error(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    columns = read_record(SYNTHETIC).head(30).columns
    head = ",".join(columns)
    rows = np.stack([c.values for c in columns.values()], axis=1)
    rows[:, 4:7] /= 9.80665
    text = "\n".join(",".join("" if x != x else repr(float(x)) for x in row) for row in rows)
    Path("g.csv").write_text(f"{head}\n{text}\n")
    assert main(["run", "mekf", "g.csv", "--on", "c"]) == 0
    assert re.fullmatch(
        r"warning: ax ay az: typically [\d.]+ m/s\^2, which looks like g \(g0 in a header\)\n",
        capsys.readouterr().err,
    )


def test_a_level_that_disagrees_with_itself_fails(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    original = Emitted.run
    monkeypatch.setattr(
        Emitted, "run", lambda self, records: replace(original(self, records), fault="not the same")
    )
    assert main(["run", "mine.py", "log.csv", "--on", "c"]) == 1
    assert capsys.readouterr().out == "FAILED c: not the same\n"
    assert main(["run", "mine.py", "log.csv"]) == 0


def test_a_truth_without_any_value(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("gap.csv").write_text("t,z,x_true\n0,1,\n0.5,1,\n")
    assert main(["run", "mine.py", "gap.csv"]) == 0
    assert capsys.readouterr().out == "2 rows to mine-fixed.csv\n"


def test_json_has_no_nan(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = MINE.replace('"h": 0.125 * u.z', '"h": (u.z * 0.0) / (u.z * 0.0)')
    Path("mine.py").write_text(text)
    assert main(["run", "mine.py", "log.csv", "--on", "numpy", "--json"]) == 0
    data = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert data["outputs"]["h"] == [None] * 3
    assert data["outputs"]["x"] == [1.5, 0.25, 2.125]


def test_a_row_per_row(capsys, tmp_path):
    log, out = SYNTHETIC, tmp_path / "out.csv"
    rows = {}
    for level in ("float", "fixed", "c"):
        assert (
            main(["run", "complementary", str(log), "--on", level, "-o", str(out), "--steps", "20"])
            == 0
        )
        lines = out.read_text().splitlines()
        names = "pitch[deg],roll[deg],heading[deg],qw,qx,qy,qz,status[bits]"
        assert lines[0] == f"t[s],{names}"
        assert len(lines) == 21
        rows[level] = lines
    assert rows["fixed"] == rows["c"]
    for a, b in zip(rows["float"][1:], rows["fixed"][1:], strict=True):
        assert float(a.split(",")[3]) == pytest.approx(float(b.split(",")[3]), abs=1e-4)
    capsys.readouterr()
