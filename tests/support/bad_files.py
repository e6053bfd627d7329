"""Files as people have them by mistake: strategies of hypothesis that give their bytes."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from hypothesis import strategies as st

from boresight.gateware.boards.frames import Kind, encode
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind as ValueKind
from boresight.model.words.program import Op, Program, Term, Value

COLUMNS = ["t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz", "qw", "qx", "qy", "qz"]
FIELDS = ["", " ", "nan", "inf", "-inf", "1e300", "-1e300", "1e999", "1e-320", "0x1", "1_0", "٣",
          "x", '"1"', "1;2", "9" * 400, "-0", "1,1", "\t2", "NaN", "9" * 5000]  # fmt: skip
LEFTOVERS = st.binary(max_size=300)


# -- logs -----------------------------------------------------------------------------------------


def _table(rows: int, reference: bool) -> list[list[str]]:
    head = COLUMNS if reference else COLUMNS[:10]
    body = [
        [f"{k / 100:.2f}", "0.01", "0.02", f"{k / 50}", "0.1", "0.2", "9.8", "1", "20", "-40"]
        + ["1", "0", "0", "0"][: len(head) - 10]
        for k in range(rows)
    ]
    return [list(head), *body]


def _faults(known: Mapping[str, Any]) -> st.SearchStrategy[list[str]]:
    """None of the faults, as often as some."""
    some = st.lists(st.sampled_from(sorted(known)), min_size=1, max_size=2)
    return st.one_of(st.just([]), some)


@st.composite
def csv_logs(draw: st.DrawFn) -> bytes:
    """A log as text: good, or with some of the faults that logs have."""
    table = _table(draw(st.sampled_from([0, 1, 5, 9, 12, 12])), draw(st.booleans()))
    for fault in draw(_faults(_CSV)):
        row = table[draw(st.integers(0, len(table) - 1))]
        _CSV[fault](draw, table, row, draw(st.integers(0, max(0, len(row) - 1))))
    text = draw(st.sampled_from(["\n", "\r\n", "\r"])).join(map(",".join, table))
    content = text.encode("utf-8", "surrogatepass") + draw(st.sampled_from([b"\n", b"", b"\n\n"]))
    return draw(_damaged(content))


def _set(draw: st.DrawFn, _: list[list[str]], row: list[str], column: int) -> None:
    row[column : column + 1] = [draw(st.sampled_from(FIELDS) | st.text(max_size=5))]


_CSV: dict[str, Callable[..., object]] = {
    "field": _set,
    "more": lambda draw, _, row, column: row.insert(column, draw(st.sampled_from(FIELDS))),
    "less": lambda _, table, row, column: row.__delitem__(slice(column, column + 1)),
    "again": lambda _, table, row, column: table.append(list(row)),
    "back": lambda _, table, row, column: table.insert(1, table.pop()),
    "comment": lambda _, table, row, column: table.insert(0, ["# made by hand"]),
    "empty": lambda _, table, row, column: table.insert(min(2, len(table)), []),
    "names": lambda _, table, row, column: table[0].reverse(),
    "column": lambda _, table, row, column: [r.__delitem__(slice(column, column + 1))
                                             for r in table],
}  # fmt: skip


@st.composite
def _damaged(draw: st.DrawFn, content: bytes) -> bytes:
    """The content, most often whole."""
    kind = draw(st.integers(0, 24))
    at = draw(st.integers(0, len(content)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + draw(st.binary(min_size=1, max_size=4)) + content[at:]
    if kind == 2:
        return draw(LEFTOVERS)
    if kind == 3:
        return draw(st.sampled_from([b"", b"\0" * 64, b"\xef\xbb\xbf" + content, b"\n" * 5]))
    return content


@st.composite
def npz_logs(draw: st.DrawFn) -> bytes:
    """A log as an archive of arrays: good or not."""
    n = draw(st.integers(1, 8))
    arrays: dict[str, Any] = {
        "t": np.arange(n) / 100.0,
        "gyr": np.full((n, 3), 0.01),
        "acc": np.tile([0.1, 0.2, 9.8], (n, 1)),
        "mag": np.tile([1.0, 20.0, -40.0], (n, 1)),
    }
    if draw(st.booleans()):
        arrays |= {"q": np.tile([1.0, 0, 0, 0], (n, 1)), "fs": 100.0, "mov": np.ones(n, bool)}
    for _ in range(draw(st.sampled_from([0, 0, 1, 2]))):
        key = draw(st.sampled_from([*arrays, "restart", "q", "mov", "fs", "other"]))
        arrays[key] = draw(_arrays(n))
    if draw(st.integers(0, 19)) == 0:
        del arrays[draw(st.sampled_from(sorted(arrays)))]
    out = io.BytesIO()
    np.savez(out, **arrays)
    return draw(_damaged(out.getvalue()))


def _arrays(n: int) -> st.SearchStrategy[Any]:
    shapes = st.sampled_from([(), (n,), (n, 3), (n, 4), (n + 1, 3), (0,), (0, 3), (1, n, 3)])
    types = st.sampled_from(["f8", "f4", "f2", ">f8", "g", "c16", "i8", "u1", "?", "U3", "S2", "O",
                             "M8[s]", "i4,f8"])  # fmt: skip
    fill = st.sampled_from([0, 1, 2, -1, np.nan, np.inf, 1e300, 5e-324])

    def make(shape: tuple[int, ...], kind: str, value: float) -> Any:
        try:
            with np.errstate(all="ignore"):
                return np.full(shape, value).astype(kind)
        except (TypeError, ValueError):
            return np.zeros(shape, dtype=kind)

    return st.builds(make, shapes, types, fill)


# -- JSON -----------------------------------------------------------------------------------------

_LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from([10**30, 10**400, -(2**31), 2**32, 1e300, "", "mekf", "complementary"]),
)
_ANY = st.recursive(
    _LEAVES,
    lambda x: st.lists(x, max_size=3) | st.dictionaries(st.text(max_size=5), x, max_size=3),
    max_leaves=6,
)
_TEXTS = st.sampled_from(
    [b"", b" ", b"[" * 9_000, b'{"a":' * 4_000, b'{"a":1,"a":2}', b"[1,]", b"NaN", b"{'a':1}",
     b"\xff\xfe{\x00}\x00", b'"\xff"', b'{"kp_roll_per_s":' + b"9" * 400 + b"}", b"9" * 5000,
     b"\xef\xbb\xbf{}", b'{"kp_roll_per_s":1e999}', b'{"kp_roll_per_s":Infinity}', b"null", b"\0",
     b'"\\ud800"', b'{"\\ud800":1}']
)  # fmt: skip


def changed(data: Any, *path: Any) -> Any:
    """A copy of JSON with the value at a path replaced by the last of it."""
    out = json.loads(json.dumps(data))
    *way, key, value = path
    at = out
    for step in way:
        at = at[step]
    at[key] = value
    return out


@st.composite
def _changed(draw: st.DrawFn, base: Any) -> Any:
    """The base, with one value somewhere in it replaced or removed, or something added."""
    out = json.loads(json.dumps(base))
    at, key = out, None
    parent = out
    while isinstance(at, dict | list) and at and draw(st.integers(0, 4)):
        parent = at
        key = draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
        at = at[key]
    if key is None:
        return draw(_ANY)
    if draw(st.booleans()):
        parent[key] = draw(_ANY)
    elif draw(st.booleans()):
        del parent[key]
    elif isinstance(parent, dict):
        parent[draw(st.text(max_size=5))] = draw(_ANY)
    else:
        parent.insert(0, at)
    return out


def _json(*bases: Any) -> st.SearchStrategy[bytes]:
    """Bytes of JSON near some good data, or far from any."""
    base = st.sampled_from(bases)
    data = st.one_of(base, base.flatmap(_changed), base.flatmap(_changed), _ANY)
    text = data.map(lambda x: json.dumps(x).encode("utf-8", "surrogatepass"))
    return st.one_of(text.flatmap(_damaged), _TEXTS)


def parameters() -> st.SearchStrategy[bytes]:
    """Parameter files."""
    return _json(
        {"kp_pitch_per_s": 0.5},
        {"estimator": "complementary", "parameters": {"kp_roll_per_s": 0.3}},
        {"estimator": "mekf", "parameters": {}},
    )


def maps() -> st.SearchStrategy[bytes]:
    """Register maps."""
    gain = {"name": "gain", "address": 7, "access": "read-write", "frac": 20, "signed": True,
            "width": 24, "minimum": -5, "maximum": 500, "reset": 1, "unit": "1/s"}  # fmt: skip
    mode = {"name": "mode", "address": 8, "access": "read-write", "names": ["slow", "fast"]}
    flags = {"name": "flags", "address": 9, "fields": [{"name": "a", "bit": 3, "width": 2}]}
    clock = {"name": "clock_hz", "address": 10, "access": "read-only", "reset": 50_000_000}
    outputs = [{"name": "qw", "frac": 29}, {"name": "status", "frac": 23}]
    return _json({"registers": [gain, mode, flags, clock], "programs": [{"outputs": outputs}]})


def reproducers() -> st.SearchStrategy[bytes]:
    """Reproducers of a difference, of a program as small as can be."""

    def value(name: str, kind: ValueKind, initial: int = 0) -> Value:
        return Value(name, kind, 10, -8.0, 8.0, "declared", initial=initial)

    program = Program(
        "tiny",
        Arithmetic(18),
        (
            value("x", ValueKind.INPUT),
            value("half", ValueKind.CONST, 512),
            value("s", ValueKind.STATE, 3),
            value("y", ValueKind.OP),
        ),
        (Op(3, (Term(0, 1, 4), Term(2, 1, 4))),),
        (0,),
        (3,),
        ("out",),
        ((2, 3),),
        (),
    )
    record = {"inputs": [[5]], "outputs": [[4]], "saturated": [False]}
    head = {"boresight_reproducer": 1, "level": "c", "config": "small", "step": 0}
    return _json({**head, **record, "program": json.loads(program.to_json())})


# -- captures -------------------------------------------------------------------------------------


@st.composite
def captures(draw: st.DrawFn) -> bytes:
    """Bytes of a board, with others between."""
    frame = st.lists(st.integers(-(2**31), 2**31 - 1), min_size=9, max_size=11).map(
        lambda words: encode(Kind.ATTITUDE, words, word=32)
    )
    text = st.sampled_from([b"+123.45 -012.34 +001.23 002A 0108 018\r\n", b"+9 x\r\n", b"\r\n"])
    pieces = draw(st.lists(st.one_of(frame, text, LEFTOVERS), max_size=5))
    return b"".join(pieces)
