"""A record: columns by name, in their units, one value per sample."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import EXACT_UNITS, QUATERNION
from boresight.model.errors import InputError, require
from boresight.model.units import UnitError, check_unit, linear

#: Suffix of the name of a column with true values of an output.
TRUTH = "_true"
#: Tolerance of the norm of a reference quaternion, for its rounding in a log.
_NORM_TOLERANCE = 0.01
#: Rows of a block.
ROWS = 1 << 16
#: Steps of which the first one is the median: a long log is read in pieces.
MEDIAN_OF = 1000
#: Remedy for times of day, or dates.
SECONDS = (
    "write seconds in place of times of day, by pandas: "
    't = pandas.Series(pandas.to_datetime(t, format="mixed")); t = (t - t[0]).dt.total_seconds()'
)
_NUMBERS = "real numbers, shape (n,)"
#: s, a time step that restarts the attitude filters.
RESTART_S = -0.25


@dataclass(frozen=True)
class Place:
    """Location of the values of a record, for messages: ``a.csv, line 7, column gx``.

    Row k is row ``start + k * every`` of the data ``where``, whose first row is in line ``line``;
    without lines a value is named by its index from 0: ``data, gx[6]``. ``by_time``: time steps are
    the differences of the column ``t``, which is named in their place.
    """

    where: str
    line: int | None = None
    start: int = 0
    every: int = 1
    by_time: bool = False

    def __call__(self, row: int, column: str) -> str:
        """Location of a value by row and column."""
        row = self.start + row * self.every
        column = "t" if self.by_time and column == "dt" else column
        if self.line is None:
            return f"{self.where}, {column}[{row}]"
        return f"{self.where}, line {row + self.line}, column {column}"

    def rows(self, start: int, every: int = 1) -> Place:
        """Locations of the rows from ``start`` on, one of ``every``."""
        return replace(self, start=self.start + start * self.every, every=self.every * every)


@dataclass(frozen=True, eq=False)
class Column:
    """Values of one name, NaN where there is no new sample; ``unit`` is None if unspecified."""

    values: FloatArray
    unit: str | None = None

    def head(self, name: str) -> str:
        """Header of the column, ``gx[deg/s]``."""
        return name if self.unit is None else f"{name}[{self.unit}]"


def name_of(path: Path) -> str:
    """Name of a file without suffix, with unprintable bytes escaped."""
    is_packed = path.name.lower().endswith(".csv.gz")
    stem = Path(path.stem if is_packed else path.name).stem
    return stem.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


@dataclass(frozen=True, eq=False)
class Record:
    """Samples of named quantities, in columns of equal length.

    ``t`` is the time, in seconds if without unit; ``NAME_true`` holds the true values of output
    NAME. ``place`` locates values in messages, where ``source`` (the file) names the record.
    ``notes`` are remarks about the data. ``comparison``: its reference is another device's
    estimate, not the truth. ``faults`` are the errors of columns that are not all numbers, raised
    when such a column is used. Raises InputError for no column, columns of different lengths, or a
    time that is missing, infinite or no number, or does not increase.
    """

    name: str
    columns: Mapping[str, Column]
    place: Place = field(default=Place("record"))
    source: str = ""
    notes: tuple[str, ...] = ()
    comparison: bool = False
    faults: Mapping[str, InputError] = field(default_factory=dict)

    def __post_init__(self) -> None:
        first: dict[int, str] = {}  # column by length
        for name, column in self.columns.items():
            first.setdefault(len(column.values), name)
        found = " and ".join(f"{count} in {name}" for count, name in first.items()) or "no column"
        wanted = "columns with one value for each sample, at least one"
        fix = "write at least one sample"
        fix = "give every column the same number of values" if len(first) > 1 else fix
        good = len(first) == 1 and 0 not in first
        require(good, self.source or f"record {self.name!r}", wanted, found, fix)
        for name, column in self.columns.items():
            infinite = np.isinf(column.values)
            if infinite.any() and name not in self.faults:
                row = int(np.argmax(infinite))
                fault = self._fault(row, name, "a finite number", "an infinite one")
                object.__setattr__(self, "faults", {**self.faults, name: fault})
        if "t" not in self.columns:
            return
        t = self.numbers("t")
        if np.isnan(t).any():
            raise self._fault(int(np.argmax(np.isnan(t))), "t", "a time in every row", "no value")
        if (is_late := np.diff(t) <= 0).any():
            row = int(np.argmax(is_late)) + 1
            raise _time_error(self, row, t[row - 1])

    def _fault(self, row: int, column: str, wanted: str, found: str) -> InputError:
        where, fix = self.place(row, column), "correct or remove the row"
        return InputError.at(where, wanted=wanted, found=found, fix=fix)

    @property
    def where(self) -> str:
        """Name of the record in messages."""
        return self.source or f"log {self.name!r}"

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())).values)

    def numbers(self, name: str) -> FloatArray:
        """Return a column in its own unit; raises the InputError of one that is not numbers."""
        if name in self.faults:
            raise self.faults[name]
        return self.columns[name].values

    def of_numbers(self) -> Record:
        """The record itself; raises InputError unless all its columns are numbers."""
        for fault in self.faults.values():
            raise InputError.at(**{**fault.parts, "fix": "correct it, or leave the column out"})
        return self

    def values(self, name: str, unit: str) -> FloatArray:
        """A column in a unit; without conversion if it has none (dt wants seconds).

        InputError for no numbers, or a unit that is unknown or of another dimension.
        """
        values, column = self.numbers(name), self.columns[name]
        if name == "dt":
            unit = unit or "s"
        if column.unit in (None, unit) or unit in EXACT_UNITS:
            return values
        assert column.unit is not None
        try:
            factor, offset = linear(column.unit, unit)
        except UnitError as error:
            where, found = f"{self.where}, column {name}", f"{column.unit} ({error})"
            wanted = f"a unit that converts to {unit or 'a plain number'}"
            fix = _gravity(column.unit, unit) or "correct the unit in the header"
            raise InputError.at(where, wanted=wanted, found=found, fix=fix) from None
        parts = round(1.0 / factor) if 0.0 < factor < 1.0 else 1
        # A quotient is rounded once: 123466 ms are 123.466 s.
        return (values / parts if abs(parts * factor - 1.0) < 1e-14 else values * factor) + offset

    def steps(self) -> FloatArray:
        """Time steps (n,) in seconds: the column ``dt``, or the differences of ``t``."""
        if "dt" in self.columns:
            return self.values("dt", "s")
        return steps_of(self.where, self.values("t", "s"))

    def times(self) -> FloatArray:
        """Times (n,) in seconds: the column ``t``, or the sums of the lengths of ``dt``."""
        if "t" in self.columns:
            return self.values("t", "s")
        return np.asarray(np.cumsum(np.abs(self.steps())))

    def derived(self, columns: Mapping[str, Column], place: Place | None = None) -> Record:
        """The record with other columns for its samples, which have been checked."""
        record = copy(self)
        object.__setattr__(record, "columns", columns)
        object.__setattr__(record, "place", place or self.place)
        return record

    def head(self, steps: int | None) -> Record:
        """Return the leading samples, with their time steps; all of them for None."""
        if steps is None or steps >= len(self):
            return self
        columns = dict(self.columns)
        if "t" in columns and "dt" not in columns:
            columns["dt"] = Column(self.steps(), "s")
        return rows_of(self.derived(columns), 0, steps)

    @classmethod
    def of(cls, data: Any, *, name: str = "record") -> Record:
        """Return a record of data in memory; for files see `sim.records.files.record_of`.

        A record, arrays (n,) by column name, a structured array, or a table: anything with
        ``columns`` and ``data[column]`` (pandas, polars). Names may carry a unit, ``gx[deg/s]``. A
        masked element (`numpy.ma`) is no sample, as NaN is. InputError for data of another type.
        """
        if isinstance(data, Record):
            return data
        names = getattr(getattr(data, "dtype", None), "names", None)
        if names is None:
            names = list(data) if isinstance(data, Mapping) else getattr(data, "columns", None)
        if names is None:
            wanted = "a path, arrays by column name, or a table with named columns"
            found, fix = type(data).__name__, 'give for example {"t": t, "z": z}'
            raise InputError.at(name, wanted=wanted, found=found, fix=fix)
        arrays = [(str(n), _array(name, str(n), data[n])) for n in names]
        columns, faults = columns_of(name, arrays)
        return cls(name, columns, Place(name), faults=faults)


def steps_of(where: str, t: npt.NDArray[Any]) -> FloatArray:
    """Step that ends at each sample, (n,); the first one is the median of the next 1,000."""
    wanted, fix = "two rows or more, for a time step", "use a longer log, or give a column dt"
    require(len(t) > 1, where, wanted, "only one", fix)
    steps = np.diff(np.asarray(t, dtype=np.float64))
    return np.concatenate([[np.median(steps[:MEDIAN_OF])], steps])


def truth_names(record: Record) -> Mapping[str, str]:
    """Columns of possible true values, by output name: ``NAME_true``, else ``NAME`` itself."""
    truths = {n.removesuffix(TRUTH): n for n in record.columns if n.endswith(TRUTH)}
    return {n: n for n in record.columns} | truths


def check_norm(record: Record, q: FloatArray) -> None:
    """Refuse a reference (n, 4) whose norm is not one; `InputError` names the row."""
    with np.errstate(over="ignore"):
        norm = np.sqrt((q * q).sum(axis=1))
    is_invalid = np.abs(norm - 1.0) > _NORM_TOLERANCE
    row, fix = int(np.argmax(is_invalid)), "correct it, or leave the whole quaternion out"
    place, found = record.place(row, QUATERNION[0]), f"norm {norm[row]:.6g}"
    require(not is_invalid.any(), place, "a quaternion of norm 1", found, fix)


def joined(blocks: list[Record]) -> Record:
    """Blocks that follow each other, as one."""
    first = blocks[0]
    if len(blocks) == 1:
        return first
    columns = {
        n: Column(np.concatenate([b.columns[n].values for b in blocks]), c.unit)
        for n, c in first.columns.items()
    }
    notes = dict.fromkeys(text for b in blocks for text in b.notes)
    faults = {n: e for b in reversed(blocks) for n, e in b.faults.items()}
    return replace(first, columns=columns, notes=tuple(notes), faults=faults)


def rows_of(record: Record, start: int, end: int) -> Record:
    """Rows of a record, named by their places in it."""
    if (start, end) == (0, len(record)):
        return record
    columns = {n: Column(c.values[start:end], c.unit) for n, c in record.columns.items()}
    return record.derived(columns, record.place.rows(start))


def timed(blocks: Iterable[Record]) -> Iterator[Record]:
    """Blocks of one log, each with its time steps as a part of the log; its times must rise."""
    blocks, first = iter(blocks), list[Record]()
    for block in blocks:
        first.append(block)
        if sum(map(len, first)) > MEDIAN_OF:
            break
    if not first:
        return
    t_last: float | None = None
    column_last = 0.0  # t_last, in the unit of the column
    for block in chain([joined(first)], blocks):
        if "t" not in block.columns or "dt" in block.columns or len(block) == 1 and t_last is None:
            yield block
            continue
        t = block.values("t", "s")
        if t_last is None:
            steps = steps_of(block.where, t)
        else:
            if block.columns["t"].values[0] <= column_last:
                raise _time_error(block, 0, column_last)
            steps = np.diff(t, prepend=t_last)
        t_last, column_last = float(t[-1]), float(block.columns["t"].values[-1])
        columns = {**block.columns, "dt": Column(steps, "s")}
        yield block.derived(columns, replace(block.place, by_time=True))


def resized(blocks: Iterable[Record], rows: int = ROWS) -> Iterator[Record]:
    """The same rows in blocks of so many; the last may be shorter."""
    pending, count = list[Record](), 0
    for block in blocks:
        pending.append(block)
        count += len(block)
        if count < rows:
            continue
        merged = joined(pending)
        for start in range(0, count - count % rows, rows):
            yield rows_of(merged, start, start + rows)
        pending = [rows_of(merged, count - count % rows, count)] if count % rows else []
        count %= rows
    if pending:
        yield joined(pending)


def _time_error(record: Record, row: int, previous: float) -> InputError:
    """The error of a row whose time is not above that of the row before."""
    t, previous = record.columns["t"], float(previous)
    unit, time, factor = t.unit or "s", float(t.values[row]), 1.0
    fix = f"correct or leave out the row of t = {time:.10g}, or sort the rows by their times; "
    fix += "where a logger began anew, make two logs"
    if time == previous:
        again = int((np.diff(t.values) == 0.0).sum())
        fix = "remove one of the two" + f", and {again - 1} more such rows" * (again > 1)
        if again > len(t.values) // 2:
            fix = "write times with more digits, or a column dt in place of t"
    with suppress(UnitError):
        factor = linear(unit, "s")[0]
    ticks = {"microseconds": 1e-6 / factor, "milliseconds": 1e-3 / factor}
    for bits, (name, tick) in product((32, 31, 24, 16), ticks.items()):
        if abs(previous - time - 2.0**bits * tick) <= 1e-3 * 2.0**bits * tick:
            fix = f"a {bits}-bit counter of {name} wraps here: add {2.0**bits * tick:.10g} to this "
            fix += "time and to those after it"
    wanted = f"a time above {previous!r} {unit}, that of the row before"
    return InputError.at(record.place(row, "t"), wanted=wanted, found=f"{time!r} {unit}", fix=fix)


def _gravity(unit: str, wanted: str) -> str:
    """The remedy where grams, or gauss, are probably multiples of standard gravity; else empty."""
    with suppress(UnitError):
        if unit.lower() in ("g", "mg", "ug"):
            linear(f"{unit.lower()}0", wanted)
            text = "for standard gravity, as g is the gram and G the gauss"
            return f"write {unit.lower()}0 {text}"
    return ""


def _array(where: str, column: str, values: Any) -> npt.NDArray[Any]:
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:  # for example rows of different lengths
        where, found = f"{where}, column {column}", type(values).__name__
        found += ", not convertible to an array"
        raise InputError.at(where, wanted=_NUMBERS, found=found, fix="convert it") from error
    if isinstance(values, np.ma.MaskedArray) and array.dtype.kind in "biuf":
        return np.where(np.ma.getmaskarray(values), np.nan, array)
    return array


def columns_of(
    where: str, arrays: Sequence[tuple[str, npt.NDArray[Any]]], *, copy: bool = True
) -> tuple[dict[str, Column], dict[str, InputError]]:
    """Columns by name, with units from brackets in the names, and the faults of some.

    An array that is not one-dimensional or not numeric has a fault, and NaN as its column. Without
    ``copy`` the arrays belong to the columns.
    """
    columns: dict[str, Column] = {}
    faults: dict[str, InputError] = {}
    heads, held = [head for head, _ in arrays], [array for _, array in arrays]
    for (name, unit), array in zip(split_headers(where, heads), held, strict=True):
        if array.ndim != 1 or array.dtype.kind not in "biuf":
            place, found = f"{where}, column {name}", f"{array.dtype}, shape {array.shape}"
            fix = SECONDS if array.dtype.kind == "M" else "convert it"
            faults[name] = InputError.at(place, wanted=_NUMBERS, found=found, fix=fix)
            length = len(array) if array.ndim else max(len(np.atleast_1d(x)) for x in held)
            array = np.full(length, np.nan)
        columns[name] = Column(array.astype(np.float64, copy=copy), unit)
    return columns, faults


#: A name, and what may be its unit.
_ROUND = re.compile(r"([^()\[\]]*[^()\[\]\s])\s*\(((?:[^()]|\([^()]*\))*)\)")


def is_unit(text: str) -> bool:
    """Whether a text has words, and all are units."""
    with suppress(InputError):
        check_unit("", text)
        return any(map(str.isalpha, text))
    return False


def split_headers(where: str, heads: Sequence[str]) -> list[tuple[str, str | None]]:
    """Names and units of columns ``gx[deg/s]``; None without brackets, and checked at its use.

    ``gx (deg/s)`` is the same. Other texts in round brackets, and those that alone make a name
    another one, ``alt (m)`` and ``alt (ft)``, are a part of the name. InputError for a name twice.
    """
    pairs = [_split_header(where, head) for head in heads]
    counts = Counter(name for name, _ in pairs)
    pairs = [
        (head.strip(), None) if counts[name] > 1 and "[" not in head else (name, unit)
        for head, (name, unit) in zip(heads, pairs, strict=True)
    ]
    for name, count in Counter(name for name, _ in pairs).most_common(1):
        found = f"{count} columns {name}"
        require(count == 1, where, "every column once", found, "keep one of them")
    return pairs


def _split_header(where: str, head: str) -> tuple[str, str | None]:
    if (round_ := _ROUND.fullmatch(head.strip())) and is_unit(round_[2]):
        return round_[1], round_[2].strip()
    parts = re.fullmatch(r"([^\[\]]*[^\[\]\s])\s*(?:\[([^\[\]]*)\])?", head.strip())
    if parts is None:
        wanted = "column names like gx or gx[deg/s]"
        raise InputError.at(where, wanted=wanted, found=repr(head), fix="correct it")
    return parts[1].strip(), None if parts[2] is None else parts[2].strip()
