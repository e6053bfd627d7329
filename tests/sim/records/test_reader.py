"""The input reader, and the records that it reads."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boresight.model.attitude import estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.records.feed import Feed, feed, fitted
from boresight.sim.records.files import content_of, read_record
from boresight.sim.records.reader import InputReader
from boresight.sim.records.record import Column, Record, steps_of

# -- records as inputs: units, steps, truths, rates --------------------------------------------

pytestmark = pytest.mark.pythons

NAN = float("nan")


class Probe(Estimator):
    """One input of each kind."""

    inputs = (
        Input("ok", 0.0, 1.0, "", valid_of=("z", "c")),
        Input("z", -2.0, 2.0, "m", missing="hold"),
        Input("c", -1.0, 3.0, "", missing=0.5, clamp=True),
        Input("plain", -4.0, 4.0, "rad/s"),
        Input("only_z", -1.0, 2.0, "", valid_of="z"),
    )
    outputs = (Output("y", "m"), Output("h", "ht"), Output("plain"), Output("s", "flags"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {}


class Timed(Estimator):
    """Reads the time step."""

    inputs = (Input("dt", -0.25, 0.5, "s"),)
    outputs = (Output("y"),)


class Warm(Estimator):
    """Its unit has another zero than a log's."""

    inputs = (Input("temperature", 200.0, 400.0, "K"),)
    outputs = (Output("y"),)


def fed(estimator: Estimator, units: dict[str, str] | None = None, **columns: Any) -> Feed:
    held = {
        n: Column(np.array(v, dtype=np.float64), (units or {}).get(n)) for n, v in columns.items()
    }
    return feed(estimator, Record("walk", held))


PROBED = {"z": [150.0, NAN], "c": [50.0, NAN], "plain": [180.0, -90.0]}
ZEROS = {"z": [0.0], "c": [0.0], "plain": [0.0]}


@pytest.mark.parametrize(
    ("kind", "units", "columns", "inputs", "truth"),
    [
        (Probe, {"z": "cm", "plain": "deg/s", "c": "percent", "y_true": "mm", "h_true": "deg"},
         {**PROBED, "y_true": [1500.0, NAN], "h_true": [90.0, -45.0], "s_true": [3.0, 4.0]},
         [[1.0, 1.5, 0.5, math.pi, 1.0], [0.0, 1.5, 0.5, -math.pi / 2, 0.0]],
         # `plain` is an input: its column is no truth
         {"y": [1.5, NAN], "h": [0.5, -0.25], "s": [3.0, 4.0]}),
        (Probe, {}, {**ZEROS, "y": [1.0]}, [[1.0, 0.0, 0.0, 0.0, 1.0]], {"y": [1.0]}),
        (Probe, {}, {**ZEROS, "y": [1.0], "y_true": [2.0]}, None, {"y": [2.0]}),
        (Probe, {}, {**ZEROS, "plain_true": [2.0]}, None, {"plain": [2.0]}),
        (Timed, {}, {"t": [0.0, 0.25, 0.375]}, [[0.1875], [0.25], [0.125]], {}),
        (Timed, {"t": "ms"}, {"t": [0.0, 250.0, 500.0]}, [[0.25]] * 3, {}),
        (Timed, {}, {"t": [0.0, 0.25], "dt": [-0.25, 0.5]}, [[-0.25], [0.5]], {}),
        (Timed, {"dt": "ms"}, {"dt": [125.0]}, [[0.125]], {}),
        (Warm, {"temperature": "degC"}, {"temperature": [0.0, 26.85]}, [[273.15], [300.0]], {}),
    ],
)  # fmt: skip
def test_columns_become_inputs(
    kind: type[Estimator], units: dict[str, str], columns: Any, inputs: Any, truth: Any
) -> None:
    result = fed(kind(), units, **columns)
    assert inputs is None or result.inputs.tolist() == inputs
    assert len(result) == len(next(iter(columns.values()))) and result.clamped == {}
    assert result.truth.keys() == truth.keys()
    for name, values in truth.items():
        assert np.array_equal(result.truth[name], values, equal_nan=True)
    if "t" in columns:
        scale = 1e-3 if "t" in units else 1.0
        assert result.t is not None and result.t.tolist() == [scale * t for t in columns["t"]]
    if "h_true" in columns:
        assert result.new.tolist() == [[True] * 5, [False, False, False, True, False]]


@pytest.mark.parametrize(
    "changes, units, message",
    [
        ({"z": None}, {}, "log 'walk': wanted a column for z [m], of probe, found c, plain; add "),
        ({"z": None, "Z": [1.0, 1.0]}, {}, "log 'walk': wanted a column for z [m], of probe, found "
         "Z, c, plain; rename Z to z"),
        ({"z": None, **{f"column {k}": [0.0] * 2 for k in range(20)}, "z (raw)": [1.0] * 2}, {},
         "log 'walk': wanted a column for z [m], of probe, found z (raw), c, plain, column 0, colum"
         "n 1, column 2, column 3, column 4, column 5, column 6, column 7, column 8, ...; rename z "
         "(raw) to z[UNIT]"),
        ({"z": None, "Z high": [1.0, 1.0]}, {"Z high": "cm"}, "log 'walk': wanted a column for "
         "z [m], of probe, found Z high, c, plain; rename Z high to z[cm]"),
        ({"z": None, "Z": [1.0, 1.0]}, {"Z": "cm"}, "log 'walk': wanted a column for z [m], of "
         "probe, found Z, c, plain; rename Z to z[cm]"),
        ({"z": None, "c": None}, {}, "log 'walk': wanted a column for z [m], c, of probe, found "),
        ({"z": [NAN, 1.0]}, {}, "record, z[0]: wanted a number in the first row, found no value; "
         "complete the log, or declare missing=NUMBER, which needs no sample before it"),
        ({"plain": [1.0, NAN]}, {}, "record, plain[1]: wanted a number, found no value; complete "
         "the log, or declare Input('plain', ..., missing=...)"),
        ({"z": [2.0, -2.5]}, {}, "record, z[1]: wanted -2 to 2 m, the declared range, found -2.5; "
         "correct the unit in the header, or the range; clamp=True would clamp it"),
        ({"z": [-2.0, 2.5]}, {}, "record, z[1]: wanted -2 to 2 m, the declared range, found 2.5; "),
        ({"z": [2.125, 3.0]}, {}, "record, z[0]: wanted -2 to 2 m, the declared range, found "
         "2.125, and 1 more beyond it; "),
        ({"z": [250.0, 1.0]}, {"z": "cm"}, "record, z[0]: wanted -2 to 2 m, the declared range, "
         "found 2.5; "),
        ({}, {"z": "kg"}, "log 'walk', column z: wanted a unit that converts to m, found kg (kg "
         "is not m); correct the unit in the header"),
        ({}, {"c": "m"}, "log 'walk', column c: wanted a unit that converts to a plain number, "
         "found m (m is not a plain number); "),
        ({}, {"plain": "xyzzy"}, "log 'walk', column plain: wanted a unit that converts to rad/s, "
         "found xyzzy (unit 'xyzzy' is not known); "),
        ({"t": [0.0, 1.0]}, {"t": "m"}, "log 'walk', column t: wanted a unit that converts to s, "),
        ({"y_true": [0.0, 1.0]}, {"y_true": "s"}, "log 'walk', column y_true: wanted a unit that "),
    ],
)  # fmt: skip
def test_refused(changes: Any, units: dict[str, str], message: str) -> None:
    columns: dict[str, Any] = {"z": [1.0, 1.0], "c": [1.0, 1.0], "plain": [1.0, 1.0]} | changes
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        fed(Probe(), units, **{n: v for n, v in columns.items() if v is not None})


def test_many_columns_are_not_all_named() -> None:
    with pytest.raises(
        InputError, match=r"wanted a column for t \[s\] or dt \[s\].*, \.\.\.; add it"
    ):
        fed(Timed(), **{f"k{n:02d}": [0.0] for n in range(40)})
    with pytest.raises(InputError, match=r"found k00, k01, .*, k07; add it"):
        fed(Timed(), **{f"k{n:02d}": [0.0] for n in range(8)})


def test_many_missing_inputs_are_all_named(tmp_path: Path) -> None:
    """The remedy is not cut: its names, written in the header, make a log."""
    values = {"time": np.arange(9.0), "gyro": np.zeros(9)}
    path = tmp_path / "log.csv"
    path.write_bytes(content_of(path, Record.of(values)))
    with pytest.raises(InputError, match="a column for 10 more inputs, of mekf, found time") as e:
        feed(estimator("mekf"), read_record(path))
    _, names = str(e.value).split("; add it, or rename the column that holds it in the header: ")
    assert names == (
        "t [s] or dt [s], gx [rad/s], gy [rad/s], gz [rad/s], mx [uT], my [uT], mz [uT], "
        "ax [m/s^2], ay [m/s^2], az [m/s^2]"
    )
    columns = [name.split(" or ")[0].replace(" ", "") for name in names.split(", ")]
    path.write_text(",".join(columns) + "\n0,0,0,0,20,0,-40,0,0,9.8\n0.01,0,0,0,20,0,-40,0,0,9.8\n")
    assert len(feed(estimator("mekf"), read_record(path))) == 2


def test_a_gap_is_named_by_its_time_and_a_cure(tmp_path: Path) -> None:
    class Short(Timed):
        inputs = (Input("dt", 0.0, 0.02, "s"),)

    path = tmp_path / "log.csv"
    path.write_text("t,a\n0.00,1\n0.01,1\n0.02,1\n0.52,1\n")
    message = "wanted a time step dt of 0 to 0.02 s, the declared range, found 0.5; correct "
    remedy = "run the rows before and after it by --to and --from; clamp=True would clamp dt"
    for record, where in (
        (read_record(path), rf"{re.escape(str(path))}, line 5, column t"),
        (Record.of({"t": [0.0, 0.01, 0.02, 0.52]}), r"record, t\[3\]"),
    ):
        with pytest.raises(InputError, match=rf"^{where}: {message}.*; if it is a gap, {remedy}$"):
            feed(Short(), record)
    with pytest.raises(InputError, match=r"found t, a; add"):
        feed(Probe(), read_record(path))


def test_words() -> None:
    program = _Timed().compile()
    result = fed(_Timed(), dt=[-0.25, 0.125, 0.5])
    frac = program.values[program.inputs[0]].frac
    assert result.words(program).tolist() == [[-(1 << frac - 2)], [1 << frac - 3], [1 << frac - 1]]


class _Timed(Timed):
    inputs = (Input("dt", -0.25, 0.75, "s"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"y": u.dt}


class Rated(Timed):
    """Made for some samples a second, at first 100."""

    inputs = (*Timed.inputs, Input("z", -2.0, 2.0, "m", missing=0.0))
    rates_hz: Mapping[str, float] = {"dt": 100.0, "z": 100.0}

    def for_rates(self, rates_hz: Any) -> Estimator:
        made = Rated()
        made.rates_hz = dict(rates_hz)
        return made


class RatedForNothing(Rated):
    def for_rates(self, rates_hz: Any) -> Any:
        """Forgets to return."""


def record_at(rate_hz: float, every: int = 1) -> Record:
    t = np.arange(40) / rate_hz
    z = np.where(np.arange(40) % every == 0, 0.5, NAN)
    return Record("walk", {"t": Column(t), "z": Column(z)})


def test_clamped_samples_are_counted() -> None:
    rows = fed(Probe(), z=[1.0, 1.0], c=[5.0, 0.0], plain=[0.0, 0.0])
    assert rows.clamped == {"c": 1} and rows.inputs[0, 2] == 3.0


def test_steps_that_contradict_the_times() -> None:
    t = np.arange(40) / 100.0
    assert len(feed(Timed(), Record.of({"t": t, "dt": np.full(40, 0.01)}))) == 40
    said = "agree, found steps of 0.005 s, and times 0.01 s apart; leave one of them out"
    with pytest.raises(InputError, match=said):
        feed(Timed(), Record.of({"t": t, "dt": np.full(40, 0.005)}))


class RatedAnew(Rated):
    """Made for the rate that its constructor takes."""

    def __init__(self, rate_hz: float = 100.0) -> None:
        self.rates_hz = {"dt": rate_hz}


@pytest.mark.parametrize(
    "rated, rate_hz, unit, remedy",
    [
        (Rated, 50.0, None, "use a log at its rate (--every thins one that is faster), or design "
         'its gains for that of the log and declare rates_hz = {"dt": 50}'),
        (RatedAnew, 50.0, None, "make it with rate_hz=50"),
        (Rated, 0.1, None, "the column t is probably in ms: write t[ms] in the header"),
        (Rated, 1e5, "ms", "the column t is probably in s: write t[s] in the header"),
        (RatedAnew, 1e-4, None, "the column t is probably in us: write t[us] in the header"),
    ],
)  # fmt: skip
def test_a_log_at_another_rate_is_refused_by_what_needs_to_know_it(
    rated: type[Rated], rate_hz: float, unit: str | None, remedy: str
) -> None:
    record = record_at(rate_hz * (1e-3 if unit else 1.0))
    record = replace(
        record, columns={**record.columns, "t": Column(record.columns["t"].values, unit)}
    )
    with pytest.raises(
        InputError,
        match=rf"wanted 100 samples a second, for which \w+ is made, found {rate_hz:.6g}; "
        f"{re.escape(remedy)}$",
    ):
        feed(rated(), record)
    assert len(feed(rated(), record_at(101.0))) == len(feed(Timed(), record_at(3.0))) == 40


def test_made_for_the_rates_of_a_record() -> None:
    made = fitted(Rated(), record_at(50.0, every=4))
    assert made.rates_hz == pytest.approx({"dt": 50.0, "z": 12.5})
    assert len(feed(made, record_at(50.0))) == 40
    timed = Timed()
    assert fitted(timed, record_at(50.0)) is timed
    no_field = Record("walk", {"t": Column(np.arange(9.0)), "z": Column(np.full(9, NAN))})
    assert fitted(Rated(), no_field).rates_hz == {"dt": 1.0}
    with pytest.raises(InputError, match="for_rates: .*found NoneType; return an estimator, or se"):
        fitted(RatedForNothing(), record_at(50.0))


# -- the input reader: the same inputs from one call as from many, and what it refuses ------------


class Gauge(Probe):
    """The same inputs, one output."""

    outputs = (Output("y", "m"),)


def reader(estimator: type[Estimator] = Gauge, runs: int = 1, **options: Any) -> InputReader:
    def place(row: int, run: int, name: str) -> str:
        return f"log, {name}[{row}, {run}]"

    return InputReader(estimator(), place, runs=runs, **options)


def by_hand(rows: list[tuple[float, float, float]]) -> tuple[list[Any], list[Any], int]:
    """What `Gauge` reads."""
    out, new, clamped, last = [], [], 0, NAN
    for z, c, plain in rows:
        has_z, has_c = z == z, c == c
        last = z if has_z else last
        value = c if has_c else 0.5
        clamped += not -1.0 <= value <= 3.0
        value = max(-1.0, min(3.0, value))
        out.append([float(has_z and has_c), last, value, plain, float(has_z)])
        new.append([has_z and has_c, has_z, has_c, True, has_z])
    return out, new, clamped


gap = st.just(NAN)
samples = st.tuples(st.floats(-2.0, 2.0) | gap, st.floats(-9.0, 9.0) | gap, st.floats(-4.0, 4.0))
rows_of_a_run = st.lists(samples, min_size=8, max_size=8).map(
    lambda rows: [(rows[0][0] if rows[0][0] == rows[0][0] else 1.0, *rows[0][1:]), *rows[1:]]
)


@settings(max_examples=150)
@given(st.lists(rows_of_a_run, min_size=1, max_size=3), st.sets(st.integers(1, 7)))
def test_pieces_of_any_length_and_any_number_of_runs(
    runs: list[list[tuple[float, float, float]]], borders: set[int]
) -> None:
    table = np.array(runs).transpose(1, 0, 2)
    inputs = reader(runs=len(runs))
    parts = []
    for first, last in zip([0, *sorted(borders)], [*sorted(borders), 8], strict=True):
        columns = dict(zip(("z", "c", "plain"), np.moveaxis(table[first:last], 2, 0), strict=True))
        parts.append(inputs.take({**columns, "more": "ignored"}, last - first))
    result, new = (np.concatenate(part) for part in zip(*parts, strict=True))
    wanted = [by_hand(rows) for rows in runs]
    for k, (values, fresh, _) in enumerate(wanted):
        assert result[:, k].tolist() == values
        assert new[:, k].tolist() == fresh
    clamped = sum(count for *_, count in wanted)
    assert inputs.clamped == ({"c": clamped} if clamped else {})
    assert inputs.rows == 8


@pytest.mark.parametrize(
    "low, high, valid, missed",
    [(0.0, 1.0, 1.0, 0.0), (-1.0, 1.0, 1.0, 0.0), (0.0, 2.0, 1.0, 0.0), (0.0, 0.5, 0.5, 0.0),
     (0.25, 4.0, 1.0, 0.25)],
)  # fmt: skip
def test_flags_are_one_and_nothing(low: float, high: float, valid: float, missed: float) -> None:
    class Flagged(Estimator):
        inputs = (Input("z", 0.0, 1.0, "", missing=0.0), Input("f", low, high, "", valid_of="z"))
        outputs = (Output("y"),)

    result, _ = reader(Flagged).take({"z": np.array([[1.0], [NAN]])}, 2)
    assert result[:, 0, 1].tolist() == [valid, missed]


# -- time steps -----------------------------------------------------------------------------------


def test_each_ends_at_its_sample_and_the_first_is_the_median() -> None:
    assert steps_of("a", np.array([1.0, 1.5, 1.75, 2.75])).tolist() == [0.5, 0.5, 0.25, 1.0]
    assert steps_of("a", np.array([0, 4])).tolist() == [4.0, 4.0]


@pytest.mark.parametrize("t", [[], [1.0]])
def test_one_sample_has_no_step(t: list[float]) -> None:
    message = "log 'a': wanted two rows or more, for a time step, found only one; use a "
    with pytest.raises(InputError, match=f"^{re.escape(message)}longer log, or give a column dt$"):
        steps_of("log 'a'", np.array(t))
