"""`sim.attitude.log_csv`: what is read, and what is said when it cannot be."""

from pathlib import Path

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.log_csv import format_csv, parse_csv

HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz"
WITH_Q = HEADER + ",qw,qx,qy,qz"
ROW = "0.0,1,2,3,4,5,6,7,8,9"
LATER = "0.5,-1,-2,-3,-4,-5,-6,-7,-8,-9"
PATH = Path("dir/a.csv")


def parse(text: str) -> dict[str, np.ndarray]:
    return parse_csv(PATH, text.encode())


def test_columns_land_in_their_arrays() -> None:
    arrays = parse(f"{HEADER}\n{ROW}\n{LATER}\n")
    assert list(arrays) == ["t", "gyr", "acc", "mag"]
    np.testing.assert_array_equal(arrays["t"], [0.0, 0.5])
    np.testing.assert_array_equal(arrays["gyr"], [[1, 2, 3], [-1, -2, -3]])
    np.testing.assert_array_equal(arrays["acc"], [[4, 5, 6], [-4, -5, -6]])
    np.testing.assert_array_equal(arrays["mag"], [[7, 8, 9], [-7, -8, -9]])


def test_column_order_is_free() -> None:
    names, values = WITH_Q.split(","), [*ROW.split(","), "0", "0.6", "0", "0.8"]
    order = np.random.default_rng(0).permutation(len(names))
    shuffled = "\n".join(",".join(line[k] for k in order) for line in (names, values))
    plain = parse("\n".join([",".join(names), ",".join(values)]))
    for key, value in parse(shuffled).items():
        np.testing.assert_array_equal(value, plain[key])
    np.testing.assert_array_equal(plain["q"], [[0, 0.6, 0, 0.8]])


@pytest.mark.parametrize(
    "text",
    [
        f"# made by hand, ä\n#t,gx\n\n{HEADER}\n{ROW}\n{LATER}",
        f"\ufeff{HEADER}\n{ROW}\n{LATER}\n\n \n",
        f"{HEADER}\r\n{ROW}\r\n{LATER}\r\n",
        f"{HEADER}\r{ROW}\r{LATER}\r",
        f"{HEADER}\n{ROW}\n{LATER}\n".replace(",", " ,\t"),
    ],
    ids=["comments", "bom-and-blank-end", "crlf", "cr", "blanks"],
)
def test_harmless_variations_are_read_alike(text: str) -> None:
    plain = parse(f"{HEADER}\n{ROW}\n{LATER}\n")
    for key, value in parse(text).items():
        np.testing.assert_array_equal(value, plain[key])


@pytest.mark.parametrize("gap", ["", " "])
def test_empty_triple_and_quaternion_are_gaps(gap: str) -> None:
    rows = [ROW + ",1,0,0,0", "0.5,1,2,3,4,5,6,,,,,,,".replace(",,", f",{gap},{gap}", 1)]
    arrays = parse("\n".join([WITH_Q, *rows]))
    np.testing.assert_array_equal(np.isnan(arrays["mag"]), [[False] * 3, [True] * 3])
    np.testing.assert_array_equal(np.isnan(arrays["q"]), [[False] * 4, [True] * 4])


def test_format_gives_the_bits_back() -> None:
    rng = np.random.default_rng(1)
    arrays = {
        "t": np.array([-0.0, 1e-300, 0.1 + 0.2]),
        "gyr": rng.normal(size=(3, 3)) * [1e-20, 1.0, 1e20],
        "acc": np.full((3, 3), np.pi),
        "mag": np.array([[np.nan] * 3, [1.0, 2.0, 3.0], [np.nan] * 3]),
        "q": np.array([[1.0, 0, 0, 0], [0, 0, 1.0, -0.0], [np.nan] * 4]),
    }
    text = format_csv(arrays)
    assert text.splitlines()[0] == WITH_Q
    assert text.splitlines()[1].endswith(",,,,1.0,0.0,0.0,0.0")
    assert text.endswith(",,,,\n")
    back = parse(text)
    for key, value in arrays.items():
        gaps = np.isnan(value)
        np.testing.assert_array_equal(np.isnan(back[key]), gaps)
        assert back[key][~gaps].tobytes() == value[~gaps].tobytes()


def replaced(column: str, field: str) -> str:
    fields = LATER.split(",")
    fields[HEADER.split(",").index(column)] = field
    return ",".join(fields)


NUMBER = r"wanted a finite number \({}\)"
GAP = r", or no value in all of the row"


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (replaced("gx", "abc"), rf", column gx: {NUMBER.format('rad/s')}, found 'abc'; correct .*"),
        (replaced("gy", "nan"), rf", column gy: {NUMBER.format('rad/s')}, found 'nan'; .*"),
        (replaced("gz", ""), rf", column gz: {NUMBER.format('rad/s')}, found an empty field; .*"),
        (replaced("ax", "-Inf"), rf", column ax: {NUMBER.format('m/s.2')}, found '-Inf'; .*"),
        (replaced("ay", "1e999"), rf", column ay: {NUMBER.format('m/s.2')}, found '1e999'; .*"),
        (replaced("az", "1_0"), rf", column az: {NUMBER.format('m/s.2')}, found '1_0'; .*"),
        (replaced("az", "٣"), rf", column az: {NUMBER.format('m/s.2')}, found '٣'; .*"),
        (replaced("az", "1.2.3"), rf", column az: {NUMBER.format('m/s.2')}, found '1\.2\.3'; .*"),
        (replaced("t", "12:00"), rf", column t: {NUMBER.format('s')}, found '12:00'; .*"),
        (replaced("t", "  "), rf", column t: {NUMBER.format('s')}, found an empty field; .*"),
        (replaced("mx", "nan"), rf", column mx: {NUMBER.format('uT')}{GAP}, found 'nan'; .*"),
        (replaced("my", ""), rf", column my: {NUMBER.format('uT')}{GAP}, found no value; .*"),
        (replaced("gx", "x" * 99), r", column gx: wanted .*, found 'x{36}\.\.\.; .*"),
        (replaced("t", "0"), r", column t: wanted a time above 0\.0, .*, found 0\.0; sort .*"),
        (LATER + ",1", r": wanted 10 fields, as in the header, found 11; complete .*"),
        ("0.5,1,2", r": wanted 10 fields, as in the header, found 3; complete .*"),
        ("", r": wanted 10 fields, as in the header, found an empty line; .*"),
    ],
)
@pytest.mark.parametrize("comments", [0, 2])
def test_faulty_rows_are_named_by_line_and_column(row: str, message: str, comments: int) -> None:
    last = "1.0" + LATER.removeprefix("0.5")
    text = "\n".join([*["# note"] * comments, HEADER, ROW, row, last])
    with pytest.raises(InputError, match=rf"^dir/a\.csv, line {3 + comments}{message}$"):
        parse(text)


def test_first_faulty_field_is_named() -> None:
    rows = [ROW, replaced("gz", "x").replace("-9", "y"), replaced("gx", "z")]
    with pytest.raises(InputError, match=r"^dir/a\.csv, line 3, column gz: .*'x'; .*$"):
        parse("\n".join([HEADER, *rows]))


def test_quaternion_off_norm_is_named() -> None:
    with pytest.raises(InputError, match=r"^dir/a\.csv, line 2, column qw: .* norm 2; .*$"):
        parse(f"{WITH_Q}\n{ROW},0,2,0,0")


def test_partial_quaternion_is_named() -> None:
    with pytest.raises(InputError, match=r"^dir/a\.csv, line 2, column qy: .* no value; .*$"):
        parse(f"{WITH_Q}\n{ROW},1,0,,0")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", rf": wanted a header {HEADER}, found an empty file; write .*"),
        (" \n\n", rf": wanted a header {HEADER}, found an empty file; write .*"),
        ("# a\n\n", rf": wanted a header {HEADER}, found only blank lines and comments; write .*"),
        (HEADER, r", line 1: wanted rows of samples below the header, found none; .*"),
        (f"#\n{HEADER}\n\n", r", line 2: wanted rows of samples below the header, found none; .*"),
        (f"{HEADER},temp,T\n", rf", line 1: wanted only .* {WITH_Q}, found 'temp', 'T'; .*"),
        (HEADER.replace(",", ";"), r", line 1: wanted only .*, found 't;gx;.*;mz'; .* by commas"),
        ("a,b,c,d", r", line 1: wanted only .*, found 'a', 'b', 'c', 'd'; .*"),
        ("a,b,c,d,e,f", r", line 1: wanted only .*, found 'a', 'b', 'c', 'd' and 2 more; .*"),
        (f"{HEADER},gx", r", line 1: wanted every column once, found 2 columns gx; .*"),
        (HEADER[2:], rf", line 1: wanted the columns {HEADER}, found none named t; .*"),
        ("t,gx,gz,ax,ay,az,mx,my", r", line 1: .* found none named gy or mz; add what is missing"),
        (WITH_Q[:-3], rf", line 1: wanted the columns {WITH_Q}, found none named qz; .*"),
        (ROW, r", line 1: wanted only the columns .*, found '0\.0', '1', .*; .*"),
    ],
)
def test_faulty_headers_are_named(text: str, message: str) -> None:
    with pytest.raises(InputError, match=rf"^dir/a\.csv{message}$"):
        parse(text)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00t", b"PK\x03\x04\x00", b"t,gx\n\xe4"])
def test_binary_is_recognised(content: bytes) -> None:
    message = r"^dir/a\.csv: wanted a CSV log in UTF-8 text, found binary data; .* \.npz$"
    with pytest.raises(InputError, match=message):
        parse_csv(PATH, content)
