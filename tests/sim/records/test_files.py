"""Log files: names, bytes, CSV, archives."""

import io
import os
import re
import sys
import threading
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from boresight.model.errors import InputError, ToolMissing
from boresight.model.estimator import Estimator, Input
from boresight.sim.records import tables, text
from boresight.sim.records.feed import feed
from boresight.sim.records.files import FORMATS, content_of, log_files, read_record, record_of
from boresight.sim.records.record import Column, Record, joined, rows_of
from tests.support.records import parsed as parsed_file

# -- log files by their names: read, written, and what is no file ---------------------------------

pytestmark = pytest.mark.pythons

T = np.array([0.0, 0.5, 0.75, 1.75])


def packed(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.NPZ", *(f"a{suffix}" for suffix in FORMATS)])
def test_written_and_read_back_exactly(tmp_path: Path, name: str) -> None:
    held = {"t": Column(T, "s"), "z": Column(np.array([np.nan, 0.1 + 0.2, -0.0, 1e-300]))}
    content = content_of(name, Record("r", held))
    assert content.startswith(b"PK") == name.lower().endswith(".npz")
    assert content == content_of(name, Record("r", held))
    (tmp_path / name).write_bytes(content)
    result = read_record(tmp_path / name)
    assert result.name == "a" and [c.unit for c in result.columns.values()] == ["s", None]
    for key, column in held.items():
        assert result.columns[key].values.tobytes() == column.values.tobytes()


@pytest.mark.parametrize(
    ("name", "module", "extra"),
    [("a.parquet", "pyarrow", "logs"), ("a.mat", "scipy", "logs"),
     ("a.mcap", "rosbags.highlevel", "ros"), ("a.ulg", "pyulog", "ulog")],
)  # fmt: skip
def test_a_missing_package_is_named(
    tmp_path: Path, monkeypatch, name: str, module: str, extra: str
) -> None:
    record = Record("r", {"z": Column(T)})
    (tmp_path / name).write_bytes(b"" if extra != "logs" else content_of(name, record))
    for loaded in [m for m in sys.modules if m.partition(".")[0] == module] + [module]:
        monkeypatch.setitem(sys.modules, loaded, None)
    calls = [lambda: read_record(tmp_path / name), lambda: content_of(name, record)]
    for call in calls[: 1 + (extra == "logs")]:
        with pytest.raises(ToolMissing, match=rf"was not found: pip install 'boresight\[{extra}\]"):
            call()


@pytest.mark.parametrize("name", ["a.h5", "a.xlsx", "a.csv.zst"])
def test_files_of_other_kinds_are_no_csv(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"\x89HDF\r\n")
    with pytest.raises(InputError, match=r"wanted a log, .csv, .* found '\.\w+'; export it as one"):
        read_record(tmp_path / name)


def test_what_others_write(tmp_path: Path) -> None:
    pyarrow, io_of = pytest.importorskip("pyarrow"), pytest.importorskip("scipy.io")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = pyarrow.table({"t[ms]": [1, 2, 3], "z": pyarrow.array([1.5, None, 2.5])})
    parquet.write_table(table, tmp_path / "a.parquet")
    result = read_record(tmp_path / "a.parquet").columns
    assert result["t"].unit == "ms" and result["t"].values.tolist() == [1.0, 2.0, 3.0]
    assert result["z"].values.tolist()[::2] == [1.5, 2.5] and np.isnan(result["z"].values[1])
    twice = pyarrow.table([[1.0], [2.0]], names=["z", "z"])
    parquet.write_table(twice, tmp_path / "a.parquet")
    with pytest.raises(InputError, match="wanted every column once, found 2 columns z"):
        read_record(tmp_path / "a.parquet")
    parquet.write_table(pyarrow.table({"z": ["a"]}), tmp_path / "a.parquet")
    with pytest.raises(InputError, match="column z: wanted real numbers"):
        read_record(tmp_path / "a.parquet").values("z", "")
    gyr = np.arange(6.0).reshape(2, 3)
    io_of.savemat(tmp_path / "b.mat", {"gyr": gyr, "t": [[0.0], [1.0]], "fs": 4.0})
    result = read_record(tmp_path / "b.mat").columns
    assert result["gz"].values.tolist() == [2.0, 5.0] and result["dt"].values.tolist() == [0.25] * 2
    (tmp_path / "c.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(64))
    with pytest.raises(InputError, match="version 7.3, which is HDF5: save it with -v7"):
        read_record(tmp_path / "c.mat")


FIELDS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.sampled_from(["", " 1", "1 ", "\t2", "+1", "1_0", "nan", "inf", "1e999", "-0", ".5", "5."]),
    st.sampled_from(["0x1", "a", '"1"', '"1,5"', ' "a"', "NaN", "-nan", "nan(1)", "1e-400"]),
    st.sampled_from(["\u0661", " ", "-", "1e", "1,2", "1\n"]),
)


@settings(max_examples=200)
@given(st.lists(st.lists(FIELDS, min_size=2, max_size=2), min_size=1, max_size=4), st.data())
def test_pyarrow_reads_what_the_slow_way_reads(rows, data) -> None:
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    head = data.draw(st.sampled_from(["a,b", "# note\n\na[s], b", "\ufeffa,b", "a,b,c", "1,2"]))
    last = data.draw(st.sampled_from(["", end, 2 * end]))
    content = (end.join([head, *map(",".join, rows)]) + last).encode()

    def read(fast_from: int) -> Any:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(text, "_FAST_FROM", fast_from)
            try:
                result = parsed_file("walk.csv", content)
            except InputError as error:
                return str(error)
            values = {n: (c.unit, c.values.tobytes()) for n, c in result.columns.items()}
            faults = {n: str(error) for n, error in result.faults.items()}
            return values, faults, result.place(1, "b")

    whole = read(0)
    assert whole == read(1 << 40)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text, "_BLOCK", data.draw(st.integers(1, 40)))
        try:
            found = joined(list(text.read_csv(PATH, io.BytesIO(content))))
        except InputError:
            assert isinstance(whole, str)  # of several faults another may be the first
        else:
            values = {n: (c.unit, c.values.tobytes()) for n, c in found.columns.items()}
            faults = {n: str(error) for n, error in found.faults.items()}
            assert (values, faults, found.place(1, "b")) == whole


def test_a_wrong_cell_of_a_long_file_is_named() -> None:
    rows = [f"{k},{k / 8}" for k in range(100_000)]
    rows[70_000] = "70000,1.2.3"
    result = parsed_file("walk.csv", "\n".join(["t,z", *rows]).encode())
    with pytest.raises(InputError, match="line 70002, column z: wanted a finite number, found"):
        result.numbers("z")


def test_of_paths_and_of_memory(tmp_path: Path) -> None:
    (tmp_path / "walk.txt").write_text("z[m]\n1.5\n")
    (tmp_path / "b.NPZ").write_bytes(packed(**{"z[m]": [1.5]}))
    for source in (tmp_path / "walk.txt", str(tmp_path / "b.NPZ")):
        result = record_of(source)
        assert result.name == Path(source).stem
        assert result.columns["z"].values.tolist() == [1.5] and result.columns["z"].unit == "m"
    assert record_of(result) is result and record_of({"z": [1.0]}, name="mine").name == "mine"
    with pytest.raises(InputError, match="wanted a log file that can be read, found no such file"):
        read_record(tmp_path / "c.csv")


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet", "a.npz"])
def test_a_pipe_is_read(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    content = content_of(name, Record.of({"z": T}))
    writer = threading.Thread(target=(tmp_path / name).write_bytes, args=(content,))
    writer.start()
    assert read_record(tmp_path / name).columns["z"].values.tolist() == T.tolist()
    writer.join()


def test_a_folder_stands_for_its_logs(tmp_path: Path) -> None:
    for name in ("b.csv", "a.npz", "notes.txt", "deep/c.csv", "e.csv.gz", "f.CSV"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    result = log_files([tmp_path / "notes.txt", tmp_path])
    assert [p.relative_to(tmp_path).as_posix() for p in result] == [
        *("notes.txt", "a.npz", "b.csv", "deep/c.csv", "e.csv.gz", "f.CSV")
    ]
    (tmp_path / "g.csv.zst").touch()
    with pytest.raises(InputError, match="found g.csv.zst beside them; convert it, or name each"):
        log_files([tmp_path])
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: wanted a log, or a folder with .* without any; "):
        log_files([tmp_path / "empty"])


# -- CSV: every number comes back bit for bit, every fault is named by line and column ------------

PATH = Path("walk.csv")
NAN = float("nan")


def parsed(text: str | bytes) -> dict[str, list[float]]:
    content = text.encode() if isinstance(text, str) else text
    result = parsed_file("walk.csv", content)
    assert result.name == "walk"
    return {n: result.numbers(n).tolist() for n in result.columns}


def bits(values: np.ndarray) -> bytes:
    """With one NaN for all."""
    return np.where(np.isnan(values), np.nan, values).tobytes()


number = st.floats(allow_infinity=False, width=64)
columns = st.integers(1, 6).flatmap(
    lambda n: st.lists(arrays(np.float64, n, elements=number), min_size=1, max_size=4)
)
names = st.lists(
    st.sampled_from(["a", "nan", "finance", "E", "inf", "mx", "x_true", "1e3x"]),
    min_size=4,
    max_size=4,
    unique=True,
)
units = st.lists(st.sampled_from([None, "", "deg/s", "nan"]), min_size=4, max_size=4)


@settings(max_examples=200)
@given(columns, names, units)
def test_round_trip(values: list[np.ndarray], heads: list[str], said: list[str | None]) -> None:
    held = {n: Column(v, u) for n, v, u in zip(heads, values, said, strict=False)}
    result = parsed_file("walk.csv", content_of("walk.csv", Record("r", held)))
    assert list(result.columns) == list(held)
    for name, column in held.items():
        assert bits(result.columns[name].values) == bits(column.values)
        assert result.columns[name].unit == column.unit


def test_text_as_written() -> None:
    held = Record.of({"t[s]": [0.0, 0.1], "nano": [NAN, 1e-300], "k[]": [-0.0, 3.0]})
    assert content_of("a.csv", held) == b"t[s],nano,k[]\n0.0,,-0.0\n0.1,1e-300,3.0\n"


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("a,b\n1,2\n3,4\n", {"a": [1.0, 3.0], "b": [2.0, 4.0]}),
        ("a,b\n1,2", {"a": [1.0], "b": [2.0]}),
        ("\ufeffa,b\r\n1,2\r\n\r\n \n", {"a": [1.0], "b": [2.0]}),
        ("a,b\r1,2\r", {"a": [1.0], "b": [2.0]}),
        ("# one\ra,b\r1,2\r", {"a": [1.0], "b": [2.0]}),
        ("a,b\n1,2\r3,4\r", {"a": [1.0, 3.0], "b": [2.0, 4.0]}),
        ("# one\n\n#two\na , b\n 1 ,\t2\n", {"a": [1.0], "b": [2.0]}),
        ("a,2\n+1.5e2,.5\n", {"a": [150.0], "2": [0.5]}),
        ("a\n1e-999\n", {"a": [0.0]}),
        ('"az[g_0]", "b, ""c"""\n"1", "2"\n', {"az": [1.0], 'b, "c"': [2.0]}),
    ],
)
def test_read(text: str, wanted: dict[str, list[float]]) -> None:
    assert parsed(text) == wanted


def test_empty_fields_are_gaps() -> None:
    for none in ("", " ", "nan", " NaN", "NAN"):
        result = parsed(f"a,b\n{none}, \n1,{none}\n")
        assert np.isnan(result["b"]).all() and np.isnan(result["a"][0]) and result["a"][1] == 1.0
    single = parsed("a\n\n1\n\n")["a"]  # of one column, an empty line is a sample without a value
    assert len(single) == 3 and single[1] == 1.0 and np.isnan(single[::2]).all()


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "walk.csv: wanted a header of column names, found an empty file; write the header "),
        (" \n# a,b\n", "walk.csv: wanted a header of column names, found only blank lines and "),
        (b"a\0\n1\n", "walk.csv: wanted a CSV log in UTF-8 text, found binary data; export it as "),
        (b"a,b\n\xfc,1\n", "walk.csv, line 2: wanted a CSV log in UTF-8 text, found the byte 0xfc,"
         " as of text in Latin-1; iconv -f latin1 -t utf-8 walk.csv > walk-utf8.csv"),
        (b"a,b\n1,2\n\0\0", "walk.csv: wanted a CSV log in UTF-8 text, found zeros from byte 8 to"
         " the end; keep its beginning: head -c 8 walk.csv > walk-cut.csv"),
        ("# x\na,b\n", "walk.csv, line 2: wanted rows of samples below the header, found none; "),
        ("a,b\n\n\n", "walk.csv, line 1: wanted rows of samples below the header, found none; "),
        ("a\n", "walk.csv, line 1: wanted rows of samples below the header, found none; "),
        ("#\na,b,a\n1,2,3\n", "walk.csv, line 2: wanted every column once, found 2 columns a; "),
        ("t;z\n0,1;2\n", "walk.csv, line 1: wanted commas between the columns, and decimal points, "
         "found semicolons; export it so, or: tail -n +1 walk.csv | tr ';,' ',.' > "),
        ("sep=;\nt;z\n0,1;2\n", "walk.csv, line 1: wanted commas between the columns, and decimal "
         "points, found semicolons; export it so, or: tail -n +2 walk.csv | tr ';,' ',.' > "),
        ("t z\n0.1 2\n", "walk.csv, line 1: wanted commas between the columns, and decimal points, "
         "found blanks; export it so, or: tail -n +1 walk.csv | tr -s ' ' ',' > walk-commas.csv"),
        ("t\tz\n0.1\t2\n", "walk.csv, line 1: wanted commas between the columns, and decimal "
         "points, found tabs; export it so, or: tail -n +1 walk.csv | tr '\\t,' ',.' > "),
        ("1,2.5\n3,4\n", "walk.csv, line 1: wanted a header of column names, found numbers only; "),
        ("0,0\n3,4\n", "walk.csv, line 1: wanted a header of column names, found numbers only; "),
        ("a,b,\n1,2,\n", "walk.csv, line 1: wanted a name between all commas, found a comma at the"
         " end; sed 's/, *\\r*$//' walk.csv > walk-columns.csv"),
        (",a\n0,2\n", "walk.csv, line 1: wanted a name for every column, found none for the "),
        ("a,b\n1,2\na,b\n3,4\n", "walk.csv, line 3: wanted a sample, found the header again; "),
        ("a (s),a (x)\n1,2\na (s),a (x)\n3,4\n", "walk.csv, line 3: wanted a sample, found the h"),
        ("t,b\n12:00:01,2\n12:00:02,3\n", "walk.csv, line 2, column t: wanted a finite number, "
         "found '12:00:01'; write seconds in place of times of day, by pandas: "
         't = pandas.Series(pandas.to_datetime(t, format="mixed")); '),
        ("t[us],b\n4294967000,1\n704,2\n", "walk.csv, line 3, column t: wanted a time above "
         "4294967000.0 us, that of the row before, found 704.0 us; a 32-bit counter of micro"
         "seconds wraps here: add 4294967296 to this time and to those after it"),
        ("a,b\n1,2\n1\n", "walk.csv, line 3: wanted 2 fields, as in the header, found 1; complete"),
        ("#\na,b\n1,2\n1,2,3\n", "walk.csv, line 4: wanted 2 fields, as in the header, found 3; "),
        ("a,b\n1,2\n\n1,2\n", "walk.csv, line 3: wanted 2 fields, as in the header, found an empt"),
        ("a,b\n1,2\n1,x\n", "walk.csv, line 3, column b: wanted a finite number, found "
         "'x'; correct or remove the line"),
        ("a,b\n1,2\n1,NA\n", "walk.csv, line 3, column b: wanted a finite number, found 'NA'; "
         "leave a missing value empty"),
        ("a,b\n1,2\n-,3\n", "walk.csv, line 3, column a: wanted a finite number, found '-'; "
         "leave a missing value empty"),
        ("t,z\nus,[cm]\n1,2\n", "walk.csv, line 2, column t: wanted a finite number, found 'us'; "
         "a line of units? write them in the header, t[us], and remove the line"),
        ("a,b\nx,2\n", "walk.csv, line 2, column a: wanted a finite number, found 'x'; correct"),
        ("a,b\n1,2\n'3',1\n", "walk.csv, line 3, column a: wanted a finite number, found "),
        ('a,b\n1,"2\n3",4\n', "walk.csv, line 2: wanted quotes around whole fields, each within "),
        ('"a",b\n"1"2,3\n', "walk.csv, line 2: wanted quotes around whole fields, each within "),
        ('a,"b,c"\n1,2\n"1,2"\n', "walk.csv, line 3: wanted 2 fields, as in the header, found 1"),
        ("a,b\n1,inf\n", "walk.csv, line 2, column b: wanted a finite number, found '"),
        ("a,b\n1,1e999\n", "walk.csv, line 2, column b: wanted a finite number, found"),
        ("a,b\n1_0,1\n", "walk.csv, line 2, column a: wanted a finite number, found '"),
        ("a,b\n٣,1\n", "walk.csv, line 2, column a: wanted a finite number, found '٣'"),
        ("a,b\n1,.\n", "walk.csv, line 2, column b: wanted a finite number, found '.'"),
        ("a\n" + "y" * 41, f"walk.csv, line 2, column a: wanted a finite number, found "
         f"'{'y' * 37}...'; "),
        ("a\n" + "y" * 40, f"walk.csv, line 2, column a: wanted a finite number, found "
         f"'{'y' * 40}'; "),
        ("#\nt,a\n1,2\n1,3\n", "walk.csv, line 4, column t: wanted a time above 1.0 s, that of "
         "the row before, found 1.0 s; "),
        ("t,a\n1,2\n,3\n", "walk.csv, line 3, column t: wanted a time in every row, found no valu"),
    ],
)  # fmt: skip
def test_refused(text: str | bytes, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        parsed(text)


def test_a_column_of_texts_is_refused_where_it_is_used(tmp_path: Path) -> None:
    """Used by no estimator, it may hold anything; a file of numbers cannot hold it."""
    content = b't,a[m],note,far\n0,1,"hello, there",1\n1,2,,inf\n2,3,x,1\n'
    result = parsed_file("walk.csv", content)
    assert result.values("a", "cm").tolist() == [100.0, 200.0, 300.0]
    for name, found in (("note", "2, column note: wanted a finite number, found 'hello, there'"),
                        ("far", "3, column far: wanted a finite number, found 'inf'")):  # fmt: skip
        for part in (
            result,
            rows_of(result, 1, 3),
            joined([rows_of(result, k, k + 1) for k in range(3)]),
        ):
            with pytest.raises(InputError, match=f"walk.csv, line {found}; correct or"):
                part.values(name, "")
    reader = Estimator()
    reader.inputs = (Input("note", 0.0, 1.0, missing=0.0),)
    with pytest.raises(InputError, match="wanted a finite number, found"):
        feed(reader, result)
    with pytest.raises(InputError, match="'hello, there'; correct it, or leave the column out"):
        content_of(tmp_path / "a.parquet", result)


def test_places_count_lines_from_the_header() -> None:
    result = parsed_file("walk.csv", b"# one\n# two\na,b\n1,2\n3,4\n")
    assert result.place(1, "b") == "walk.csv, line 5, column b"
    assert result.head(1).place(0, "a") == "walk.csv, line 4, column a"


# -- archives: columns by array, the nine-axis form, steps of a rate ------------------------------


def archive_parsed(**arrays: Any) -> dict[str, Column]:
    result = parsed_file("walk.npz", packed(**arrays))
    assert result.name == "walk"
    assert all(len(result.numbers(name)) for name in result.columns)
    return dict(result.columns)


@pytest.mark.parametrize(
    ("arrays", "wanted"),
    [
        ({"gyr": np.arange(12.0).reshape(4, 3)}, {"gx": [0, 3, 6, 9], "gz": [2, 5, 8, 11]}),
        ({"acc": np.arange(12.0).reshape(4, 3)}, {"ax": [0, 3, 6, 9], "az": [2, 5, 8, 11]}),
        ({"mag": np.arange(12.0).reshape(4, 3)}, {"mx": [0, 3, 6, 9], "mz": [2, 5, 8, 11]}),
        ({"q": np.arange(8.0).reshape(2, 4)}, {"qw": [0, 4], "qx": [1, 5], "qz": [3, 7]}),
        ({"q": [1.0, 2.0]}, {"q": [1, 2]}),  # a column may have the name of several
        ({"t": T}, {"t": T, "dt": None}),
        ({"t": T, "fs": 8}, {"dt": [0.125] * 4, "fs": None}),
        ({"z": T, "fs": [8.0]}, {"dt": [0.125] * 4}),
        ({"t": T, "restart": [0, 0, 1, 0]}, {"restart": [0, 0, 1, 0]}),
    ],
)
def test_archives(arrays: Any, wanted: dict[str, Any]) -> None:
    result = archive_parsed(**arrays)
    for name, values in wanted.items():
        assert (name in result) == (values is not None)
        assert values is None or result[name].values.tolist() == list(values)


@pytest.mark.parametrize(
    "arrays, message",
    [
        ({}, "walk.npz: wanted arrays, found an empty archive; store one array per column"),
        ({"gyr": np.zeros((4, 4))}, "walk.npz, array gyr: wanted shape (n, 3), found (4, 4); stor"),
        ({"q": np.zeros((4, 3))}, "walk.npz, array q: wanted shape (n, 4), found (4, 3); "),
        ({"acc": np.zeros((1, 4, 3))}, "walk.npz, array acc: wanted shape (n, 3), found (1, 4, 3)"),
        ({"z": np.zeros((4, 3))}, "walk.npz, column z: wanted real numbers, shape (n,), found "),
        ({"t": T, "gx": T, "gyr": np.zeros((4, 3))}, "walk.npz: wanted every column once, found 2 "
         "columns gx; keep one of them"),
        ({"gyr": np.zeros((4, 3)), "gz": T}, "walk.npz: wanted every column once, found 2"),
        ({"gyr": np.zeros((4, 3)), "gz[deg/s]": T}, "walk.npz: wanted every column once, found 2 "
         "columns gz; "),
        ({"fs": 8.0, "t": T, "dt": T}, "walk.npz: wanted every column once, found 2 columns dt; "),
        ({"fs": 8.0, "t": 1.0}, "walk.npz, column t: wanted real numbers, shape (n,), found "
         "float64, shape (); "),
        ({"fs": 0.0, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found 0.0; correct "),
        ({"fs": np.nan, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found nan; "),
        ({"fs": np.inf, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found inf; "),
        ({"fs": [8, 8], "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found [8, 8]; "),
        ({"fs": "8", "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found '8'; "),
        ({"t": T[::-1]}, "walk.npz, t[1]: wanted a time above 1.75 s, that of the row before, fou"
         "nd 0.75 s; "),
        ({"t": T, "z": T[1:]}, "walk.npz: wanted columns with one value for each sample, at least "
         "one, found 4 in t and 3 in z; give"),
        ({"z": np.array([1.0, np.inf])}, "walk.npz, z[1]: wanted a finite number, found an infin"),
    ],
)  # fmt: skip
def test_archive_refused(arrays: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        archive_parsed(**arrays)


def junk_member() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("notes.txt", "no array")
    return buffer.getvalue()


def array_alone() -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, T)
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"t,z\n1,2\n",
        array_alone(),
        packed(t=T)[:-40],
        packed(z=np.array([None])),
        junk_member(),
    ],
)
def test_what_is_no_archive(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(
        InputError,
        match=r"a\.npz: wanted an \.npz archive of plain arrays, found a file that cannot be read "
        r"as one \(.*\); write it again, or give it the suffix of what it holds$",
    ):
        read_record(tmp_path / "a.npz")


def test_an_archive_that_is_large_when_it_is_unpacked_is_refused_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez_compressed(tmp_path / "a.npz", t=np.zeros(1 << 17))
    monkeypatch.setattr(tables, "_LARGEST", 1 << 20)
    with pytest.raises(InputError, match=r"a\.npz: wanted at most 0 GiB of arrays, found 0\.00097"):
        read_record(tmp_path / "a.npz")


def test_text_in_utf_16(tmp_path: Path) -> None:
    (tmp_path / "wide.csv").write_bytes("a\n1\n".encode("utf-16"))
    with pytest.raises(InputError, match="found UTF-16 text; export it as UTF-8"):
        read_record(tmp_path / "wide.csv")
