"""Calibration from records: registers, uncertainties, the command, and what it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.sim.attitude import system
from boresight.sim.attitude.calibration.solve import LINE, mounting
from boresight.sim.records.files import content_of
from boresight.sim.records.record import Column, Record
from tests.support.attitude.calibration import calibration_records, device, trial
from tests.support.attitude.serial_board import SerialBoard

linalg = pytest.importorskip("scipy.linalg")

#: Short records of few samples.
SIZE = {"rate_hz": 128.0, "rest_s": 2.0, "positions": 12, "repetitions": 3, "seconds": 20.0}
BOARD = "board(field_ut=(0, 27.9, -46.2), sight_deg=0.05)"


@cache
def records() -> tuple[Record, ...]:
    return tuple(calibration_records(device(3), 3, **SIZE))


def changed(column: str, change: Callable | None, only: str = "") -> list[Record]:
    """The records with another column, or without it."""
    out = []
    for record in records():
        columns = dict(record.columns)
        if column in columns and only in record.name:
            old = columns.pop(column)
            if change is not None:
                columns[column] = Column(change(old.values), old.unit)
        out.append(Record(record.name, columns))
    return out


def test_registers_and_attitude() -> None:
    trials = [trial(seed, **SIZE) for seed in (1, 2)]
    errors = np.array([[*t.errors.values()] for t in trials])
    assert errors.shape == (2, 37)
    assert np.abs(errors).max() < 4.0 and 0.6 < np.sqrt((errors**2).mean()) < 1.1
    for t in trials:
        assert t.attitude["found"] < t.attitude["true"] + 0.1 < 0.2 * t.attitude["declared"]


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_a_hundred_devices() -> None:
    """The figures of docs/systems/ma2014.md, in 15 minutes."""
    trials = [trial(seed) for seed in range(1, 101)]
    inside = sum(max(map(abs, t.errors.values())) <= 3.0 for t in trials)
    of = {kind: float(np.median([t.attitude[kind] for t in trials])) for kind in trials[0].attitude}
    print(inside, of)
    assert inside >= 95
    assert 9.0 < of["declared"] < 12.0
    assert of["found"] < 0.33 and of["found"] < 1.05 * of["true"]


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    """The file that the command writes for records in files."""
    folder = tmp_path_factory.mktemp("calibration")
    for record in records():
        (folder / f"{record.name}.csv").write_bytes(content_of("log.csv", record))
    assert main(["fit", BOARD, str(folder), "-o", str(folder / "calibration.json")]) == 0
    return folder / "calibration.json"


def test_the_paper_s_tables(calibration) -> None:
    data, (gyro, *_) = json.loads(calibration.read_text()), device(3).triads
    for (name, found), triad in zip(data["noise"].items(), device(3).triads, strict=True):
        axes = np.linalg.inv(triad.matrix)  # of the body, in which the noise is given
        true = axes**2 @ (np.array(triad.variance) + triad.lsb**2 / 12.0)
        assert np.asarray(found) == pytest.approx(true, rel=0.2), name
    t0 = np.array(data["mounting"]["T0"])
    assert t0 @ t0.T == pytest.approx(np.eye(3), abs=1e-12)
    assert t0 == pytest.approx(np.array(gyro.matrix), abs=0.05)  # which is misaligned, too


def test_mounting() -> None:
    """T is the mean over ten repetitions; T0 = T (T^T T)^(-1/2)."""
    rng = np.random.default_rng(1)
    b = np.linalg.qr(rng.standard_normal((3, 3)))[0] + 0.2
    true = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    true *= np.linalg.det(true)
    s = [true @ b + 0.01 * rng.standard_normal((3, 3)) for _ in range(10)]
    t, t0 = mounting(np.vstack([x.T for x in s]), np.tile(b.T, (10, 1)))
    assert t == pytest.approx(np.mean([x @ np.linalg.inv(b) for x in s], axis=0))
    assert t0 == pytest.approx(t @ np.linalg.inv(linalg.sqrtm(t.T @ t)))


def test_board_and_host_take_the_file(calibration, tmp_path) -> None:
    values = json.loads(calibration.read_text())["parameters"]
    given = {"params": [f"@{calibration}"], "output": tmp_path}
    boresight.compile("complementary", board="mimas", **given)
    path = tmp_path / "ise-mimas" / "registers.json"
    registers = {r["name"]: r for r in json.loads(path.read_text())["registers"]}
    with SerialBoard({}) as board:
        boresight.monitor(board.port, writes=[f"@{calibration}"], register_map=path)
        written = dict(board.written)
    assert len(written) == 37
    for program, some in values.items():
        for name, value in some.items():
            register = registers[f"{program}.{name}"]
            assert register["reset"] == round(value * 2 ** register["frac"])
            assert written[register["address"]] & 0xFFFF_FFFF == register["reset"] & 0xFFFF_FFFF


def test_simulated_board_takes_the_file(calibration, tmp_path, monkeypatch) -> None:
    cores = []
    monkeypatch.setattr(system, "FILTERS", ("complementary",))
    monkeypatch.setattr(system, "write_board", lambda _, __, core, *a, **k: cores.append(core))
    boresight.run("complementary", "board", params=[f"@{calibration}"], output=tmp_path)
    values = json.loads(calibration.read_text())["parameters"]
    programs = {part.program.name: part.program for part in cores[0].parts}
    for program, some in values.items():
        words = {v.name: v for v in programs[program].values}
        for name, value in some.items():
            assert words[name].initial == round(value * 2 ** words[name].frac)


def test_without_stamps_there_are_36() -> None:
    found = boresight.fit(BOARD, *changed("stamp", None), output="/dev/null")
    assert sum(map(len, found["parameters"].values())) == 36
    assert "tick_s" in found.notes[0]


def test_clock_of_a_log_whose_times_are_stamps() -> None:
    logs = []
    for record in records():
        stamp = record.numbers("stamp")
        t = np.cumsum(np.diff(stamp, prepend=stamp[0]) % 2**32) * 1e-8
        columns = {**record.columns, "t": Column(t), "computer": record.columns["t"]}
        logs.append(Record(record.name, columns))
    found = boresight.fit(BOARD, *logs, output="/dev/null")
    tick, sigma = (found[k]["calibrate_inertial"]["tick_s"] for k in ("parameters", "sigma"))
    assert abs(tick - device(3).tick_s) < 4.0 * sigma < 1e-13


def test_clock_of_a_computer_that_hears_late() -> None:
    """Half of the time late by up to 0.2 s, for a second at a time: the gyro's scale is kept."""
    rng, logs = np.random.default_rng(1), []
    for record in records():
        t = record.numbers("t")
        late = rng.uniform(-0.2, 0.2, 1 + int(t[-1])).clip(0.0)[t.astype(int)]
        computer = Column(np.maximum.accumulate(t + late), "s")
        logs.append(Record(record.name, {**record.columns, "computer": computer}))
    found = boresight.fit(BOARD, *logs, output="/dev/null")
    true = device(3).registers()["calibrate_inertial"]
    some, sigma = (found[k]["calibrate_inertial"] for k in ("parameters", "sigma"))
    assert sigma["tick_s"] < 1e-4 * true["tick_s"]
    for name in ("tick_s", "gyro_xx", "gyro_yy", "gyro_zz"):
        assert abs(some[name] - true[name]) < 4.0 * sigma[name]


REFUSED = {
    "three or more sighted rests": changed("heading", None),
    "a fit that does not converge": changed("heading", np.negative),
    "mirror image": changed("roll", np.negative),
    "found none that do": changed("gx_counts", np.zeros_like),
    "do not span a sphere": changed("mx_counts", lambda v: 0.0 * v),
    "no column mz_counts": changed("mz_counts", None),
    "sights, field_ut: wanted axes": changed("mx_counts", np.negative),
    "6 or more rests": records()[:1],
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused(message, tmp_path) -> None:
    with pytest.raises(boresight.InputError, match=message):
        boresight.fit(BOARD, *REFUSED[message], output=tmp_path / "calibration.json")


def test_sights_that_contradict_are_not_written(tmp_path) -> None:
    wrong = changed("heading", lambda v: v + 10.0)
    result = boresight.fit(BOARD, *wrong, output=tmp_path / "calibration.json")
    assert not result.good and "sights" in result.failures[0]
    assert not (tmp_path / "calibration.json").exists()


def test_a_log_of_headings() -> None:
    logs = [
        Record(r.name, {n: c for n, c in r.columns.items() if n[0] != "m"} | dict.fromkeys(LINE, c))
        for r in records()
        for c in [Column(np.full(len(r), np.nan))]
    ]
    with pytest.raises(boresight.InputError, match="found none; record with --write compass_mode"):
        boresight.fit(BOARD, *logs, output="/dev/null")


WRONG = (
    "board",
    "board(field_ut=(1, 2))",
    "board(fild=1)",
    "board(field_ut=(0, 0.0279, -0.0462))",
    "board(field_ut=('a', 27.9, -46.2))",
    "board(field_ut=((0, 1), 27.9, -46.2))",
    "board(field_ut=(0, 27.9, -46.2), gravity=1)",
    "board(field_ut=(0, 27.9, -46.2), sight_deg=0)",
)


@pytest.mark.parametrize("board", WRONG)
def test_wrong_settings(board, tmp_path, capsys) -> None:
    (tmp_path / "rest.csv").write_bytes(content_of("rest.csv", records()[0]))
    assert main(["fit", board, str(tmp_path / "rest.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
