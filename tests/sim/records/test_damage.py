"""Damaged logs of every kind: one line and exit code 2, or the rows before with a warning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sim.records.files import FORMATS, bundled, content_of, read_record
from boresight.sim.records.record import Column, Record
from tests.support.flights import flight, in_motion, write_bag

ROWS = 60
TABLE = read_record(bundled("synthetic_60s")).head(ROWS)
DAMAGES = ("cut", "bits", "order", "missing", "backwards", "nan")
KINDS = (*FORMATS, ".ulg", ".bag", ".mcap", ".db3")


def table(damage: str, rng: np.random.Generator) -> Record:
    """Columns, of which one is missing, has no numbers here and there, or times that step back."""
    columns = {n: c.values.copy() for n, c in TABLE.columns.items()}
    if damage == "missing":
        del columns[rng.choice([*columns])]
    elif damage == "backwards":
        columns["t"][rng.integers(1, ROWS) :] -= rng.choice([1e-9, 0.01, 5.0])
    elif damage == "nan":
        columns[rng.choice([*columns])][rng.random(ROWS) < rng.choice([0.02, 0.5, 1.0])] = np.nan
    return TABLE.derived({n: Column(v) for n, v in columns.items()})


def topics(damage: str, rng: np.random.Generator) -> dict[str, Any]:
    """The same of messages."""
    made = {n: list(rows) for n, rows in in_motion(ROWS).items()}
    of = rng.choice([*made])
    if damage == "missing":
        del made[of]
    elif damage == "backwards":
        rng.shuffle(made[of])
    elif damage == "nan":
        made[of] = [(t, [x * rng.choice([1.0, np.nan]) for x in row]) for t, row in made[of]]
    return made


def written(path: Path, damage: str, rng: np.random.Generator) -> None:
    """A damaged file."""
    if path.suffix == ".ulg":
        path.write_bytes(flight(messages=topics(damage, rng)))
    elif path.suffix in (".bag", ".mcap", ".db3"):
        write_bag(path, topics(damage, rng))
    else:
        path.write_bytes(content_of(path, table(damage, rng)))
    content = bytearray(path.read_bytes())
    at = int(rng.integers(len(content)))
    if damage == "cut":
        del content[at:]
    elif damage == "bits":
        for place in (at, *rng.integers(len(content), size=rng.choice([0, 10]))):
            content[place] ^= 1 << rng.integers(8)
    elif damage == "order":  # of words of eight bytes, from somewhere on
        words = np.frombuffer(content[at:], np.uint8)[: (len(content) - at) // 8 * 8]
        content[at : at + len(words)] = words.reshape(-1, 8)[:, ::-1].tobytes()
    path.write_bytes(content)


def check(kind: str, count: int, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The first of each damage from the command line, more of them by the reader alone."""
    if kind in (".bag", ".mcap", ".db3"):
        pytest.importorskip("rosbags")
    codes, refused = list[int](), 0
    for number in range(count):
        here = folder / str(number)
        here.mkdir()
        path, out, damage = here / f"a{kind}", here / "out.csv", DAMAGES[number % len(DAMAGES)]
        written(path, damage, np.random.default_rng([31, number]))
        if number >= len(DAMAGES):
            try:
                read_record(path)
            except InputError as error:
                refused += 1
                assert str(error).startswith(str(path)) and "\n" not in str(error), (number, error)
            assert capsys.readouterr() == ("", "")
            continue
        codes.append(main(["run", "complementary", str(path), "--levels", "c", "-o", str(out)]))
        said = capsys.readouterr().err.splitlines()
        case = (number, damage, said)
        if codes[-1] == 0:
            rows = out.read_bytes().count(b"\n") - 1
            whole = damage != "cut" or kind in FORMATS or rows == ROWS
            assert whole or any("warning: " in line for line in said), case
        else:
            assert codes[-1] == 2 and len(said) == 1 and said[0].startswith("error: "), case
            assert str(path) in said[0] or "'a'" in said[0], case
            assert not out.exists(), case
    assert codes.count(2) >= len(codes) // 3, codes
    assert refused >= (count - len(codes)) // 3, refused


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check(kind, 24 if kind in (".bag", ".mcap", ".db3") else 60, tmp_path, capsys)


def test_a_table_without_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A turned bit in the number of rows, for one."""
    path = tmp_path / "a.parquet"
    path.write_bytes(content_of(path, TABLE.derived({"t": Column(np.zeros(0))})))
    assert main(["run", "complementary", str(path), "-o", str(tmp_path / "out.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "out.csv").exists()


def test_a_page_checksum_of_parquet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One bit of a value, in a file whose pages have checksums."""
    parquet, path = pytest.importorskip("pyarrow.parquet"), tmp_path / "a.parquet"
    content = {name: TABLE.columns[name].values for name in TABLE.columns}
    parquet.write_table(
        pytest.importorskip("pyarrow").table(content),
        path,
        compression="none",
        use_dictionary=False,
        write_page_checksum=True,
    )
    run = ["run", "complementary", str(path), "-o", str(tmp_path / "out.csv")]
    assert main(run) == 0
    capsys.readouterr()
    damaged = bytearray(path.read_bytes())
    at = damaged.find(np.float64(content["t"][1]).tobytes())
    damaged[at] ^= 1
    path.write_bytes(damaged)
    (tmp_path / "out.csv").unlink()
    assert main(run) == 2
    assert "CRC" in capsys.readouterr().err and not (tmp_path / "out.csv").exists()


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
def test_many_damaged_files(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check(kind, 1000, tmp_path, capsys)
