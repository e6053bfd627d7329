"""Records: columns, units, the nine-axis log, what is implausible, the bundled logs."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, bundled_names, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.plausible import estimate_warnings, warnings_of
from boresight.sim.records.record import Column, Place, Record

# -- records: what they refuse, what they are made of, headers with units -------------------------

pytestmark = pytest.mark.pythons

NAN = float("nan")


class Table:
    """What pandas and polars have in common: ``columns`` and ``data[column]``."""

    def __init__(self, **columns: Any) -> None:
        self._held, self.columns = columns, list(columns)

    def __getitem__(self, name: str) -> Any:
        return self._held[name]


def test_head() -> None:
    whole = Record(
        "r", {"z": Column(np.arange(3.0), "m"), "w": Column(np.arange(3.0) + 5.0)}, Place("walk")
    )
    assert whole.head(None) is whole.head(3) is whole.head(9) is whole
    cut = whole.head(2)
    assert (cut.name, len(cut)) == ("r", 2)
    assert cut.columns["w"].values.tolist() == [5.0, 6.0]
    assert (cut.columns["z"].unit, cut.columns["w"].unit) == ("m", None)
    assert cut.place(1, "z") == "walk, z[1]"


def test_a_head_keeps_the_steps_of_the_whole() -> None:
    """The first step, which nothing precedes, is the median of all, not of those that are left."""
    whole = Record("r", {"t": Column(np.array([0.0, 4.0, 5.0, 6.0, 7.0]) * 1e3, "ms")})
    assert whole.steps().tolist() == [1.0, 4.0, 1.0, 1.0, 1.0]
    assert whole.head(2).steps().tolist() == [1.0, 4.0]
    assert whole.head(1).steps().tolist() == [1.0]
    own = Record("r", {**whole.columns, "dt": Column(np.full(5, 500.0), "ms")})
    assert own.steps().tolist() == [0.5] * 5 == [*own.head(4).steps().tolist(), 0.5]


def test_values_in_a_unit() -> None:
    made = Record("r", {"a": Column(np.array([2.0]), "km"), "b": Column(np.array([3.0]))})
    assert made.values("a", "m").tolist() == [2000.0] and made.values("b", "m").tolist() == [3.0]
    ms = np.arange(123_000.0, 124_000.0)
    seconds = [float(f"{t:.0f}e-3") for t in ms]  # 123.466, not 123.46600000000001
    assert Record.of({"t[ms]": ms}).values("t", "s").tolist() == seconds
    assert made.values("a", "bits") is made.columns["a"].values
    message = (
        "log 'r', column a: wanted a unit that converts to s, found km (km is not s); correct "
    )
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        made.values("a", "s")
    for unit, remedy in (("g", "write g0 for"), ("mg", "write mg0 for"), ("kg", "correct the un")):
        forces = Record("r", {"a": Column(np.array([1.0]), unit)})
        with pytest.raises(InputError, match=rf"\({unit} is not m/s\^2\); {remedy}"):
            forces.values("a", "m/s^2")


def test_of_mappings_tables_and_structured_arrays() -> None:
    structured = np.array([(0, 1.5), (1, 2.5)], dtype=[("n", "i4"), ("z[deg/s]", "f4")])
    for data in (
        {"n": [0, 1], "z[deg/s]": np.array([1.5, 2.5], dtype=np.float32)},
        Table(**{"n": [0, 1], "z[deg/s]": (1.5, 2.5)}),
        structured,
    ):
        made = Record.of(data, name="mine")
        assert made.name == "mine" and list(made.columns) == ["n", "z"]
        assert [c.unit for c in made.columns.values()] == [None, "deg/s"]
        assert made.columns["z"].values.tolist() == [1.5, 2.5]
        assert made.columns["n"].values.dtype == np.float64
        assert made.place(1, "z") == "mine, z[1]"


def test_masked_elements_are_no_samples() -> None:
    masked = np.ma.masked_array([1, 2, 3], [False, True, False])
    columns = Record.of({"a": masked, "b": np.ma.masked_array([0.5, 1.5, 2.5])}).columns
    assert np.isnan(columns["a"].values).tolist() == [False, True, False]
    assert columns["a"].values[2] == 3.0 and columns["b"].values.tolist() == [0.5, 1.5, 2.5]
    assert masked.mask.tolist() == [False, True, False]


LENGTHS = "record 'mine': wanted columns with one value for each sample, at least one, found "
NUMBERS = "mine, column z: wanted real numbers, shape (n,), found "
INF = float("inf")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (5, "mine: wanted a path, arrays by column name, or a table with named columns, found int; "
         'give for example {"t": t, "z": z}'),
        (np.zeros((3, 2)), "mine: wanted a path, arrays by column name, or a table with named "
         "columns, found ndarray; "),
        ({}, LENGTHS + "no column; "),
        ({"a": []}, LENGTHS + "0 in a; write at least one sample"),
        ({"a": [1.0], "b": [1.0, 2.0], "c": [3.0]}, LENGTHS + "1 in a and 2 in b; "),
        ({"z": 3.0}, NUMBERS + "float64, shape (); "),
        ({"z": np.zeros((2, 3))}, NUMBERS + "float64, shape (2, 3); convert it"),
        ({"z": ["a", "b"]}, NUMBERS + "<U1, shape (2"),
        ({"z": [1j]}, NUMBERS + "complex128, shape"),
        ({"z": np.array(["2020-01-01"], dtype="M8[D]")}, NUMBERS + "datetime64[D], "
         "shape (1,); write seconds in place of times of day, by pandas: t = "),
        ({"z": [[1.0], [1.0, 2.0]]}, NUMBERS + "list, not convertible to an array; convert it"),
        ({"z": [1.0], " z[m]": [1.0]}, "mine: wanted every column once, found 2 columns z; keep "),
        ({"a": [1.0, 2.0], "b": [NAN, INF]}, "mine, b[1]: wanted a finite number, found an "
         "infinite one; correct or remove the row"),
        ({"t": [0.0, NAN, NAN]}, "mine, t[1]: wanted a time in every row, found no value; "),
        ({"t": [0.0, 2.0, 2.0, 1.0]}, "mine, t[2]: wanted a time above 2.0 s, that of the row "
         "before, found 2.0 s; remove one of the two"),
        ({"t": [0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 4.0]}, "mine, t[2]: wanted a time above 1.0 s, that "
         "of the row before, found 1.0 s; remove one of the two, and 1 more such rows"),
        ({"t": [0.0, 0.0, 0.0, 1.0, 1.0]}, "mine, t[1]: wanted a time above 0.0 s, that of the row "
         "before, found 0.0 s; write times with more digits, or a column dt in place of t"),
        ({"t": [0.0, 2.0, 1.0, 0.5]}, "mine, t[2]: wanted a time above 2.0 s, that of the row "
         "before, found 1.0 s; correct or leave out the row of t = 1, or sort the rows"),
        ({"t": [0.0, 1.0, 0.5]}, "mine, t[2]: wanted a time above 1.0 s, that of the row before,"
         " found 0.5 s; "),
        ({"t": [0.0, 1.0, 2.0, 3.0, -5.0, 5.0, 6.0]}, "mine, t[4]: wanted a time above 3.0 s, that "
         "of the row before, found -5.0 s; correct or leave out the row of t = -5"),
        ({"t": [0.0, 1.0, 3.0, 4.0, 2.0, 5.0, 6.0]}, "mine, t[4]: wanted a time above 4.0 s, that "
         "of the row before, found 2.0 s; correct or leave out the row of t = 2"),
        *(({head: [1.0]}, f"mine: wanted column names like gx or gx[deg/s], found {head!r}; correc")
          for head in ("", " ", "[m]", "a[m", "am]", "a[m]b", "a[[m]]", "a[m][s]", "a]["))
    ],
)  # fmt: skip
def test_refused(data: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        made = Record.of(data, name="mine")
        for name in made.columns:
            made.numbers(name)


def test_what_a_record_is_made_of() -> None:
    data = {" flag ": np.array([True, False]), "n [ m/s^2 ]": np.array([3, 4], dtype=np.uint8)}
    made = Record.of({**data, "z[]": [NAN, 2.0]}, name="a.npz")
    columns = {n: (c.values.tolist()[1:], c.unit) for n, c in made.columns.items()}
    assert columns == {"flag": ([0.0], None), "n": ([4.0], "m/s^2"), "z": ([2.0], "")}
    assert made.place(1, "z") == "a.npz, z[1]" and np.isnan(made.columns["z"].values[0])
    assert Record.of(made) is made
    heads = ("t(ms)", "a (m/s^2)", "b(m/(s*s))", "x(1)", "y (raw)", "z (m) (2)")
    columns = {n: c.unit for n, c in Record.of(dict.fromkeys(heads, [0.0])).columns.items()}
    units = {"t": "ms", "a": "m/s^2", "b": "m/(s*s)"}
    assert columns == {**units, **dict.fromkeys(heads[3:])}
    heads = ("h[m]", "h (ft)", "alt (m)", "alt (ft)")
    columns = {n: c.unit for n, c in Record.of(dict.fromkeys(heads, [0.0])).columns.items()}
    assert columns == {"h": "m", **dict.fromkeys(heads[1:])}


# -- the nine-axis log as a record, and back ------------------------------------------------------

T = np.array([0.0, 0.5, 1.5])
MAG = np.arange(9.0).reshape(3, 3) + 20
MAG[1] = NAN
Q = np.array([[1.0, 0, 0, 0], [NAN] * 4, [0, 0, 0.6, 0.8]])


def log(**more: Any) -> NineAxis:
    return NineAxis(
        "walk", T, np.arange(9.0).reshape(3, 3), np.arange(9.0).reshape(3, 3) + 10, MAG, **more
    )


def test_there_and_back() -> None:
    names = ["t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"]
    plain = log().record()
    assert [*plain.columns] == names and plain.place(2, "gy") == "log 'walk', gy[2]"
    assert plain.columns["gy"].values.tolist() == [1.0, 4.0, 7.0]
    mov, steps = np.array([True, False, True]), np.array([0.75, -0.25, 1.0])
    back = NineAxis.of(log(q=Q, mov=mov, steps=steps).record())
    for key in ("t", "gyr", "acc", "mag"):
        assert np.array_equal(getattr(back, key), getattr(log(), key), equal_nan=True)
    assert np.array_equal(back.attitude, Q, equal_nan=True) and len(back) == 3
    assert back.counts.tolist() == mov.tolist() and back.dt.tolist() == steps.tolist()
    assert back.mag_new.tolist() == [True, False, True]
    only_steps = back.record().derived({n: c for n, c in back.record().columns.items() if n != "t"})
    assert NineAxis.of(only_steps).t.tolist() == [0.75, 1.0, 2.0]
    assert NineAxis.of(only_steps).dt.tolist() == steps.tolist()
    again = NineAxis.of(plain)
    assert again.dt.tolist() == log().dt.tolist() == [0.75, 0.5, 1.0]
    assert again.counts.all() and again.q is None
    with pytest.raises(InputError, match="^log 'walk': wanted a reference attitude, found none"):
        _ = again.attitude


def test_other_units_and_names() -> None:
    columns = dict(log(q=Q).record().columns)
    columns |= {
        "t": Column(T * 1e3, "ms"),
        "gx": Column(np.array([180.0, 0.0, 90.0]), "deg/s"),
        "ay": Column(np.ones(3), "g0"),
        "mz": Column(np.array([0.5, NAN, 1.0]), "gauss"),
        **{f"{n}_true": columns.pop(n) for n in ("qw", "qx", "qy", "qz")},
    }
    result = NineAxis.of(Record("r", columns))
    assert result.t.tolist() == T.tolist()
    assert result.gyr[:, 0] == pytest.approx([np.pi, 0.0, np.pi / 2])
    assert result.acc[:, 1] == pytest.approx(9.80665)
    assert result.mag[::2, 2] == pytest.approx([50.0, 100.0])
    assert np.array_equal(result.attitude, Q, equal_nan=True)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"gy": None}, "log 'walk': wanted the columns t,gx,gy,gz,ax,ay,az,mx,my,mz, found no "
         "column gy; add what is missing"),
        ({"t": None}, "log 'walk': wanted the columns t,gx,gy,gz,"),
        ({"ax": [0.0, NAN, 0.0]}, "log 'walk', ax[1]: wanted a number, found no value; complete "),
        ({"my": [0.0, NAN, NAN]}, "log 'walk', my[2]: wanted a number, or none in all of the row, "
         "found no value; "),
        ({"my": [0.0, 1.0, 0.0]}, "log 'walk', mx[1]: wanted a number, or none in all of the row"),
        ({"qz": [0.0, NAN, NAN]}, "log 'walk', qz[2]: wanted a number, or none in all of the row"),
        ({"qz": [0.0, NAN, 0.9]}, "log 'walk', qw[2]: wanted a quaternion of norm 1, found norm 1."
         "08167; correct it, or leave the whole quaternion out"),
    ],
)  # fmt: skip
def test_nine_axis_refused(change: dict[str, Any], message: str) -> None:
    columns = dict(log(q=Q).record().columns)
    for name, values in change.items():
        del columns[name]
        if values is not None:
            columns[name] = Column(np.array(values))
    record = Record("walk", columns, log().record().place)
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        NineAxis.of(record)


# -- warnings about values that cannot be what their unit says ------------------------------------


class Sensors(Estimator):
    """Triples between other inputs; a flag beside them."""

    inputs = (
        Input("gx", -99.0, 99.0, "rad/s"),
        Input("ax", -9999.0, 9999.0, "m/s^2"),
        Input("mx", -1e6, 1e6, "uT"),
        Input("gy", -99.0, 99.0, "rad/s"),
        Input("ay", -9999.0, 9999.0, "m/s^2"),
        Input("my", -1e6, 1e6, "uT"),
        Input("gz", -99.0, 99.0, "rad/s"),
        Input("az", -9999.0, 9999.0, "m/s^2"),
        Input("mz", -1e6, 1e6, "uT"),
        Input("new_z", 0.0, 1.0, "uT", valid_of="mz"),
        Input("spin", -99.0, 99.0, "rad/s"),
        Input("shaft", -999.0, 999.0, "rad/s"),
        Input("thrust", -999.0, 999.0, "m/s^2"),
        Input("dt", -0.25, 0.25, "s", clamp=True),
    )
    outputs = (Output("y"),)


class SixAxes(Sensors):
    inputs = tuple(i for i in Sensors.inputs if i.name[0] in "gad")


class InMilliseconds(Sensors):
    inputs = (*Sensors.inputs[:-1], Input("dt", -250.0, 250.0, "ms", clamp=True))


def warned(**values: float) -> tuple[str, ...]:
    usual = {"ax": 6.0, "ay": 0.0, "az": 8.0, "mx": 30.0, "my": 40.0, "mz": 0.0, "thrust": 1.0}
    row = [{**usual, **values}.get(declared.name, 0.0) for declared in Sensors.inputs]
    return warnings_of(Sensors(), np.array([row] * 3), np.ones((3, len(row)), bool))


def test_an_offset_of_the_field() -> None:
    inputs = np.zeros((400, len(Sensors.inputs)))
    inputs[:, [i.name == "az" for i in Sensors.inputs]] = 9.8
    at, turn = [i.name for i in Sensors.inputs].index("mx"), np.linspace(0.0, 20.0, 400)
    inputs[:, at], inputs[:, at + 3] = 60.0 + 45.0 * np.cos(turn), 45.0 * np.sin(turn)
    text, *_ = warnings_of(Sensors(), inputs, np.ones(inputs.shape, bool))
    assert text.startswith("mx my mz: 1") and text.endswith("a magnet or iron near, or an offset?")


@pytest.mark.parametrize(
    "values, text",
    [
        ({"gx": 6.0, "gz": 8.1}, "gx gy gz: typically 10.1 rad/s, which looks like deg/s"),
        ({"spin": -10.5}, "spin: typically 10.5 rad/s, which looks like deg/s"),
        ({"ax": 0.6, "az": 0.8}, "ax ay az: typically 1 m/s^2, which looks like g (g0 in a "
         "header)"),
        ({"ax": 0.0, "az": 0.0}, "ax ay az: typically 0 m/s^2, too little for gravity: is the "
         "sensor dead, or has the device removed it?"),
        ({"ax": 600.0, "az": 800.0}, "ax ay az: typically 1e+03 m/s^2, which looks like mg (mg0 in "
         "a header)"),
        ({"mx": 0.3, "my": 0.4}, "mx my mz: typically 0.5 uT, which looks like gauss"),
        ({"mx": 300.0, "my": 400.0}, "mx my mz: typically 500 uT, which looks like milligauss"),
        ({"mx": 3e4, "my": 4e4}, "mx my mz: typically 5e+04 uT, which looks like nT"),
        *(({}, ""), ({"gx": 10.0}, ""), ({"shaft": 500.0}, "")),
        *(({"az": 0.0, "ax": 5.1}, ""), ({"my": 8.0, "mx": 0.0}, "")),
        ({"dt": 0.25}, ""),
        ({"dt": -0.1}, "dt: beyond its range in most rows; is t in seconds?"),
    ],
)  # fmt: skip
def test_odd(values: dict[str, float], text: str) -> None:
    assert warned(**values) == ((text,) if text else ())


@cache
def turned(length: int = 1500) -> dict[str, np.ndarray]:
    """Rates, force and field of a body that turns, with noise, at 100 Hz."""
    rng = np.random.default_rng(3)
    t = 0.01 * np.arange(length)
    rate = np.stack([np.sin(0.7 * t + k) * 0.1 for k in range(3)], axis=1)
    turns = Rotation.identity()
    force, field = [], []
    for w in rate:
        turns = turns * Rotation.from_rotvec(0.01 * w)
        force.append(turns.inv().apply([0.0, 0.0, 9.81]))
        field.append(turns.inv().apply([0.0, 20.0, -40.0]))
    noise = [rng.normal(0.0, s, (length, 3)) for s in (0.001, 0.02, 0.05)]
    return {"g": rate + noise[0], "a": np.array(force) + noise[1], "m": np.array(field) + noise[2]}


SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({}, ""),
        ({"g": 57.3}, "gx gy gz: contradict how ax ay az and mx my mz turn: .* look like deg/s"),
        ({"g": -1.0}, "gx gy gz: contradict .*: the sign is wrong"),
        ({"g": [-1.0, 1.0, 1.0]}, "gx gy gz: contradict .*fit as -x, y, z"),
        ({"g": 2.0}, "gx gy gz and mx my mz contradict .*: the rates are 2 times as large"),
        ({"a": SWAP}, "ax ay az: do not turn as the rates gx gy gz say"),
        ({"m": [1.0, -1.0, -1.0]}, "mx my mz: do not turn as the rates gx gy gz say"),
    ],
)
def test_rates_that_contradict_how_the_vectors_turn(change: dict[str, Any], text: str) -> None:
    made = dict(turned())
    for name, factor in change.items():
        is_exchange = np.ndim(factor) == 2
        made[name] = made[name] @ factor if is_exchange else made[name] * np.asarray(factor)
    inputs = np.zeros((len(made["g"]), len(Sensors.inputs)))
    for k, declared in enumerate(Sensors.inputs):
        if declared.name[:-1] in made:
            inputs[:, k] = made[declared.name[:-1]][:, "xyz".index(declared.name[-1])]
        elif declared.name == "dt":
            inputs[:, k] = 0.01
    lines = warnings_of(Sensors(), inputs, np.ones(inputs.shape, bool))
    assert len(lines) == (text != "") and re.match(text, "".join(lines)), lines
    inputs[:, -1] *= 1000.0
    assert warnings_of(InMilliseconds(), inputs, np.ones(inputs.shape, bool)) == lines


def scaled(names: str, factor: float) -> Any:
    return lambda c: {n: c[n] * factor for n in names.split()}


def late(names: str, rows: int) -> Any:
    return lambda c: {n: np.roll(c[n], rows) for n in names.split()}


def repeated(names: str, rows: int, first: int = 0) -> Any:
    """Each sample for so many rows."""
    return lambda c: {n: c[n][first + np.arange(len(c[n])) // rows * rows] for n in names.split()}


def stuck(name: str) -> Any:
    """One axis that keeps a sample for a fifth of the log."""
    rows = np.arange(12625)
    at = np.where((rows > 4000) & (rows < 6525), 4000, rows)
    return lambda c: {name: np.where(np.isnan(c[name]), np.nan, c[name][at])}


def clipped(c: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {n: np.clip(c[n], -19.6133, 19.6133) for n in ("ax", "ay", "az")}


def filled(c: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    last = np.maximum.accumulate(np.where(np.isnan(c["mx"]), 0, np.arange(len(c["mx"]))))
    return {n: c[n][last] for n in ("mx", "my", "mz")}


RATES, FORCE, FIELD, ATTITUDE = "gx gy gz", "ax ay az", "mx my mz", "qw qx qy qz"
#: Mistakes on a recording: what changes, with or without its attitude, and the one line.
CARELESS = [
    (scaled(FIELD, 1e-6), True, f"{FIELD}: .* looks like tesla"),
    (scaled("t", 1000.0), True, "dt: .* is t in seconds"),
    (scaled("t", 2.0), True, f"{RATES}: contradict .* 2 times as large"),
    (scaled(RATES, 1.2), False, f"{RATES}: 1, 1.1, 1.3 times as large as {FIELD} turn"),
    (scaled(RATES, 0.8), False, f"{RATES} and {FIELD} contradict .* 0.83 times as large"),
    (scaled("gx", 2.0), False, f"{RATES} and {FIELD} contradict .* x is about 2 times as large"),
    (scaled(RATES, 0.0), False, f"{RATES}: do not explain how {FIELD} turn"),
    (scaled(RATES, np.pi / 180.0), False, f"{RATES} and {FIELD} contradict .* 0.018 times"),
    (scaled("gz", 0.0), False, f"{RATES}: gz is 0 in every sample"),
    (lambda c: {"mz": 0.0 * c["mz"] - 12.5}, False, f"{FIELD}: mz is -12.5 in every sample"),
    (scaled(FORCE, 0.8), False, f"{FORCE}: a mean of 7.8 m/s\\^2 over 1 s, too little"),
    (scaled(RATES, -1.0), False, f"{RATES}: contradict .*: the sign is wrong"),
    (scaled("gy", -1.0), False, f"{RATES}: contradict .* x, -y, z"),
    (scaled("ay", -1.0), False, f"{FORCE}: do not turn"),
    (scaled("mz", -1.0), False, f"{FIELD}: do not turn"),
    (lambda c: {"ax": c["ay"], "ay": c["ax"]}, False, f"{FORCE}: do not turn"),
    (scaled(FORCE, -1.0), True, f"{FORCE}: point down by {ATTITUDE}"),
    (scaled(FORCE, -1.0), False, f"{FIELD}: point 42 deg up by {FORCE}"),
    (scaled(FIELD, -1.0), True, f"{FIELD}: point south by {ATTITUDE}"),
    (scaled(FORCE, 1.25), False, f"{FORCE}: a mean of 12 m/s\\^2 over 6.8 s, too much"),
    (lambda c: {"mx": c["mx"] + 15.0}, False, f"{FIELD}: an offset of 15, -2.8, -1.9 uT"),
    (lambda c: {"gz": c["gz"] + 0.3}, False, f"{RATES}: an offset of 0.018, 0, 0.26 rad/s"),
    (lambda c: {n: np.nan_to_num(c[n]) for n in FIELD.split()}, False, f"{FIELD}: 0 in 4431 sam"),
    (lambda c: {"ay": c["ax"]}, False, f"{FORCE}: ay is ax in every sample"),
    (
        lambda c: {n: np.where(c["t"] > 34.0, np.nan, c[n]) for n in FIELD.split()},
        False,
        f"{FIELD}: no sample in the last 3920 of 12625 rows",
    ),
    (stuck("mz"), False, f"{FIELD}: mz stays at -23.19 for 9.89 s"),
    (late(FORCE, 8), False, f"{FORCE}: 0.035 s late"),
    (late(RATES, 77), True, f"{RATES}: 0.3 s late"),
    (late(FIELD, 77), False, f"{FIELD}: 0.3 s late"),
    (late(ATTITUDE, 52), True, f"{ATTITUDE}: 0.2 s late"),
    (repeated(RATES, 2), True, f"{RATES}: 50% of the samples repeat"),
    (filled, True, f"{FIELD}: 35% of the samples repeat"),
    (repeated(FIELD, 12624), True, f"{FIELD}: do not turn as the rates"),
    (repeated(FORCE, 20000), True, f"{FORCE}: do not turn as the rates"),
    (clipped, True, f"{FORCE}: 213 samples are at an end"),
    (scaled("qx qy qz", -1.0), True, f"{ATTITUDE}: do not turn .* its conjugate fits"),
    (
        lambda c: {"qw": c["qx"], "qx": c["qy"], "qy": c["qz"], "qz": c["qw"]},
        True,
        f"{ATTITUDE}: do not turn .* it fits as x, y, z, w",
    ),
    (
        lambda c: {
            "qw": (c["qw"] - c["qz"]) * 0.5**0.5,
            "qx": (c["qx"] - c["qy"]) * 0.5**0.5,
            "qy": (c["qy"] + c["qx"]) * 0.5**0.5,
            "qz": (c["qz"] + c["qw"]) * 0.5**0.5,
        },
        True,
        f"{ATTITUDE}: take the field 90 deg from north",
    ),
]


@pytest.fixture(scope="module")
def recording() -> dict[str, np.ndarray]:
    return {n: c.values for n, c in read_record(bundled("ximu_walk")).columns.items()}


@pytest.mark.parametrize(("change", "has_attitude", "text"), CARELESS)
def test_a_mistake_in_a_recording_is_one_line(
    recording: dict[str, np.ndarray], change: Any, has_attitude: bool, text: str
) -> None:
    whole = {**recording, **change(recording)}
    columns = {n: v for n, v in whole.items() if has_attitude or n[0] != "q"}
    (line,) = feed(estimator("mekf"), Record.of(columns)).warnings
    assert re.match(text, line), line


#: Mistakes in the first 23 s of the recording, which turns fast only at times, without an attitude.
IN_SHORT = [
    (lambda c: {}, ""),
    (scaled(RATES, 0.5 / np.pi), f"{RATES} and {FIELD} contradict .* 0.1[56] times as large"),
    (scaled(RATES, 0.5), f"{RATES} and {FIELD} contradict .* 0.49 times as large"),
    (scaled(RATES, 1.2), f"{RATES} and {FIELD} contradict .* 1.2 times as large"),
    (scaled("gz", -1.0), f"{RATES} and {FIELD} contradict .* x, y, -z"),
    (scaled("my", -1.0), f"{FIELD}: do not turn as the rates"),
    (scaled("t", 1.25), f"{RATES} and {FIELD} contradict .* 1.2 times as large"),
    (scaled("t", 0.001), "dt: typically 3.9e-06 s, less than of any gyro"),
    (late(FIELD, 26), f"{FIELD}: 0.1 s late"),
    (late(RATES, 26), f"{FIELD}: 0.1 s (early|late)|{RATES}: 0.1 s late"),
    (filled, f"{FIELD}: 36% of the samples repeat"),
]


@pytest.mark.parametrize(("change", "text"), IN_SHORT)
def test_a_mistake_in_a_short_recording_is_one_line(
    recording: dict[str, np.ndarray], change: Any, text: str
) -> None:
    part = {n: v[:6000] for n, v in recording.items() if n[0] != "q"}
    lines = feed(estimator("mekf"), Record.of({**part, **change(part)})).warnings
    assert len(lines) == (text != "") and re.match(text, "".join(lines)), lines


def test_the_rest_of_a_slow_log_is_not_told() -> None:
    """Steps of a simulation without noise, and a still sensor, are no mistakes."""
    still = {"t": 0.01 * np.arange(2000), **dict.fromkeys(RATES.split(), np.zeros(2000))}
    vectors = dict(zip(f"{FORCE} {FIELD}".split(), (0.0, 0.0, 9.81, 0.0, 20.0, -40.0), strict=True))
    still |= {n: np.full(2000, v) for n, v in vectors.items()}
    assert feed(estimator("mekf"), Record.of(still)).warnings == ()
    still["gz"] = np.where(np.arange(2000) // 500 % 2, 0.5, 0.0)
    heading = np.cumsum(still["gz"]) * 0.01
    still |= {"mx": 20.0 * np.sin(heading), "my": 20.0 * np.cos(heading)}
    assert feed(estimator("mekf"), Record.of(still)).warnings == ()
    short = {n: v[:40] for n, v in still.items()}
    assert feed(estimator("mekf"), Record.of(short)).warnings == ()


@pytest.mark.parametrize(
    ("rate", "force"),
    [
        ([0.0, 0.0, 0.3], [4.0, 0.0, 9.81]),
        ([0.0, 0.0, -25.0], [0.0, 0.0, 9.81]),
        ([0.0, 0.21, 0.12], [0.0, 0.0, 19.6]),
    ],
)
def test_a_steady_turn_is_not_told(rate: list[float], force: list[float]) -> None:
    """Without noise: a car's circle, with its force at rest in the car; a fast spin; an aircraft.

    The header states the rates in deg/s, and is believed.
    """
    t = 0.01 * np.arange(4000)
    field = Rotation.from_rotvec(-np.outer(t, rate)).apply([20.0, 0.0, -40.0])
    names = [f"{name}[deg/s]" for name in RATES.split()]
    columns = {"t": t, **dict(zip(names, np.full((4000, 3), np.degrees(rate)).T, strict=True))}
    columns |= zip(FORCE.split(), np.full((4000, 3), force).T, strict=True)
    columns |= zip(FIELD.split(), field.T, strict=True)
    assert feed(estimator("mekf"), Record.of(columns)).warnings == ()
    assert feed(SixAxes(), Record.of(columns)).warnings == ()


def test_accelerations_of_a_slow_car_are_no_offset_of_its_rates() -> None:
    """It pitches against them, as if the rates were much too large, and of the other sign."""
    rng = np.random.default_rng(1)
    gyro, noise = rng.normal(size=(2, 1500, 3))
    drive = np.convolve(rng.normal(size=1500), np.hanning(60), "same")
    drive *= 2.0 / drive.std()
    rates = 0.02 * gyro - 0.026 + np.outer(np.gradient(drive, 0.02), [0.0, -0.01, 0.0])
    force = 0.06 * noise + [0.0, 0.0, 9.81] + np.outer(drive, [1.1, 0.0, 0.0])
    columns = {"t": 0.02 * np.arange(1500), **dict(zip(RATES.split(), rates.T, strict=True))}
    columns |= zip(FORCE.split(), force.T, strict=True)
    assert feed(SixAxes(), Record.of(columns)).warnings == ()


@pytest.mark.parametrize("offset", [-0.05, 0.05])
def test_a_usual_offset_in_a_slow_turn_is_no_scale(offset: float) -> None:
    """About one axis the two look alike."""
    rng = np.random.default_rng(1)
    t, noise = 0.01 * np.arange(4000), rng.normal(size=(3, 3, 4000))
    turn, still = 0.2 * t, np.zeros(4000)
    rates = np.stack([still, still, np.full(4000, 0.2 + offset)]) + 0.002 * noise[0]
    force = np.stack([still, still, np.full(4000, 9.81)]) + 0.05 * noise[1]
    field = np.stack([20.0 * np.sin(turn), 20.0 * np.cos(turn), still - 40.0]) + 0.3 * noise[2]
    names = f"{RATES} {FORCE} {FIELD}".split()
    columns = {"t": t, **dict(zip(names, [*rates, *force, *field], strict=True))}
    assert feed(estimator("mekf"), Record.of(columns)).warnings == ()


@pytest.mark.parametrize(("offset", "speed"), [([0.04, 0.03, 0.0], 0.1), ([0.05, 0.0, 0.0], 0.02)])
def test_a_usual_offset_of_rates_is_none_of_the_field(offset: list[float], speed: float) -> None:
    """In 10 s of small turns about the vertical, either explains how the field turns."""
    rng = np.random.default_rng(2)
    t, (gyro, force, field) = 0.01 * np.arange(1000), rng.normal(size=(3, 1000, 3))
    yaw = speed / 0.6 * np.sin(0.6 * t)
    rates = 0.02 * gyro + offset + np.outer(speed * np.cos(0.6 * t), [0.0, 0.0, 1.0])
    north = np.stack([20.0 * np.sin(yaw), 20.0 * np.cos(yaw), np.full(1000, -42.0)], axis=1)
    values = np.hstack([rates, 0.05 * force + [0.0, 0.0, 9.81], 0.2 * field + north])
    columns = dict(zip(f"{RATES} {FORCE} {FIELD}".split(), values.T, strict=True))
    assert feed(estimator("mekf"), Record.of({"t": t, **columns})).warnings == ()


def test_an_estimate_may_jump_where_it_restarts() -> None:
    inputs, restarts = np.zeros((3000, len(SixAxes.inputs))), np.zeros(3000, bool)
    inputs[:, -1], restarts[750::500] = 0.01, True
    turn = np.cumsum(restarts) * 1.5
    outputs = dict(
        zip(ATTITUDE.split(), (np.cos(turn), np.sin(turn), *np.zeros((2, 3000))), strict=True)
    )
    every = np.ones(inputs.shape, bool)
    (line,) = estimate_warnings(SixAxes(), inputs, every, outputs)
    assert re.match(f"{ATTITUDE}: turn 30 deg or more away from {RATES}", line)
    assert estimate_warnings(SixAxes(), inputs, every & ~restarts[:, None], outputs) == []
    inputs[restarts, -1] = -0.25
    assert estimate_warnings(SixAxes(), inputs, every, outputs) == []


def test_typical_is_the_median_of_new_samples() -> None:
    inputs = np.zeros((4, len(Sensors.inputs)))
    inputs[:, 1], inputs[:, 2] = 9.8, 50.0
    new = np.ones(inputs.shape, bool)
    inputs[0, 0] = 900.0  # one outlier of four
    assert warnings_of(Sensors(), inputs, new) == ()
    inputs[:2, 2], new[2:, 5] = 0.5, False  # my is not new there, so the field is not
    assert warnings_of(Sensors(), inputs, new) == (
        "mx my mz: 2 rows have some of them, not all",
        "mx my mz: typically 0.5 uT, which looks like gauss",
    )
    new[:, [2, 5]] = False
    assert warnings_of(Sensors(), inputs, new) == ("mx my mz: 4 rows have some of them, not all",)


def test_a_pair_of_axes_is_no_vector() -> None:
    class Pair(Estimator):
        inputs = tuple(Input(f"a{axis}", -20.0, 20.0, "m/s^2") for axis in "xy")
        outputs = (Output("y"),)

    for new in ([[True, True]], [[True, False]]):
        assert warnings_of(Pair(), np.array([[0.6, 0.8]]), np.array(new)) == ()


# -- the logs in the package ----------------------------------------------------------------------


def test_bundled_logs(tmp_path: Path) -> None:
    assert bundled_names() == ("synthetic_60s", "ximu_walk")
    for name in bundled_names():
        record = read_record(bundled(name))
        assert record.name == name and feed(estimator("mekf"), record).warnings == ()
    assert "Thomas Haslwanter" in (bundled("ximu_walk").parent / "README.md").read_text()
    # The attitude of one is not truth, in a copy neither.
    assert [read_record(bundled(name)).comparison for name in bundled_names()] == [False, True]
    copy = tmp_path / "mine.csv"
    copy.write_bytes(bundled("ximu_walk").read_bytes())
    assert read_record(copy).comparison
    message = r"wanted one of synthetic_60s, ximu_walk, found 'x'; choose one of these$"
    with pytest.raises(InputError, match=message):
        bundled("x")


class Gauges(Estimator):
    """An input that may be missing, and others: none of them a vector."""

    inputs = (
        Input("dt", 0.0, 1.0, "s"),
        Input("ay", -50.0, 50.0, "m/s^2", missing="hold"),
        Input("ay_new", 0.0, 1.0, valid_of="ay"),
        Input("level", -5000.0, 5000.0),
    )
    outputs = (Output("y"),)


@pytest.mark.parametrize(
    ("head", "meant"),
    [
        ("restart (0/1)", "restart"),
        ("Restart", "restart"),
        ("mov (flag)", "mov"),
        ("dt (step)", "dt[UNIT]"),
        ("Y_true[V]", "y_true[V]"),
        ("y_truth", "y_true"),
        ("y_true{V}", "y_true[UNIT]"),
        ("y_true (level)", "y_true[UNIT]"),
        *((head, "") for head in ("restart", "y", "y_true", "T", "ax", "yaw_true")),
    ],
)
def test_a_column_with_nearly_a_known_name_is_told(head: str, meant: str) -> None:
    log = {"t": [0.0, 1.0, 2.0], "ay": [1.0, 2.0, 3.0], "level": [3.0, 1.0, 2.0]}
    told = [f"column {head.partition('[')[0]} is not used: rename it to {meant}, if that is meant"]
    assert [*feed(Gauges(), Record.of({**log, head: [0, 1, 0]})).warnings] == told * bool(meant)


def test_a_column_restart_that_is_an_input_restarts_nothing_and_is_told() -> None:
    inputs = (*Gauges.inputs, Input("restart", 0.0, 1.0))
    for last, told in ((0.0, 0), (1.0, 1)):
        log = {"t": [0.0, 1.0], "ay": [1.0, 2.0], "level": [3.0, 1.0], "restart": [0.0, last]}
        result = feed(type("Gauges", (Gauges,), {"inputs": inputs})(), Record.of(log))
        assert not result.restarts.any() and len(result.warnings) == told
        assert all("column restart is an input of gauges" in text for text in result.warnings)


@pytest.mark.parametrize("every", [2, 4, 20, 100])
@pytest.mark.parametrize("how", ["evenly", "at random"])
@pytest.mark.parametrize("name", ["ay", "level"])
def test_repeats_of_any_input_are_told(name: str, how: str, every: int) -> None:
    if how == "at random" and every > 20:
        return  # as of a command that changes at times
    rng = np.random.default_rng(every)
    z = np.sin(np.arange(8000) * 0.02) + rng.normal(0.0, 0.05, 8000)
    new = np.arange(8000) % every == 0 if how == "evenly" else rng.random(8000) < 1.0 / every
    new[0] = True
    held = z[np.maximum.accumulate(np.where(new, np.arange(8000), 0))]
    log = {"dt": [0.01] * 8000, "ay": z, "level": z + 1.0}
    (text,) = feed(Gauges(), Record.of({**log, name: held})).warnings
    assert text.startswith(f"{name}: {1.0 - (np.count_nonzero(new) - 1) / 7999:.0%} of the samples")
    assert text.endswith("leave what is not new empty, or thin the log by --every")
    untimed = type("Gauges", (Gauges,), {"inputs": Gauges.inputs[1:]})()
    (text,) = feed(untimed, Record.of({**log, name: held})).warnings
    assert text.endswith("leave what is not new empty")
    assert feed(Gauges(), Record.of({**log, name: np.where(new, z, NAN) if name == "ay" else z})
                ).warnings == ()  # fmt: skip


def test_what_repeats_by_chance_is_not_told() -> None:
    rng, k = np.random.default_rng(1), np.arange(8000)
    ramp = 20.0 + 0.0005 * k
    for values in (
        np.full(8000, 3.25),
        np.round(ramp * 16.0) / 16.0,  # a thermometer
        np.round(ramp + rng.normal(0.0, 1.0, 8000)),  # counts
        np.round(rng.normal(0.0, 0.3, 8000)),
        np.where(k % 40 < 10, 12.0, 0.0),  # a command
        np.where(k % 7 < 3, 4000.0, -4000.0),
        rng.choice([0.0, 100.0, 250.0, 400.0], 400).repeat(20),
        np.clip(3000.0 * np.sin(k * 0.05), -2000.0, 2000.0),
        np.where(k % 2000 < 1500, 0.0, rng.normal(0.0, 9.0, 8000)),  # at rest most of the time
        np.interp(k, np.arange(0, 8001, 400), rng.normal(0.0, 900.0, 10).repeat(2).tolist() + [0]),
    ):
        log = {"dt": [0.01] * 8000, "ay": rng.normal(0.0, 1.0, 8000), "level": values}
        assert feed(Gauges(), Record.of(log)).warnings == ()
