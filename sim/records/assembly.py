"""A record of a recording: rows at the times of its fastest sensor.

A sample of a slower sensor stands in the first row at or after its own time; rows between have
none. True values are interpolated to the rows. Messages are sorted by their times; whatever is left
out is counted.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.errors import InputError, require
from boresight.model.tools.external import optional
from boresight.sim.records.record import Column, Place, Record, name_of
from boresight.sim.records.recordings import TIME_UNITS, Recording, Source, Topic
from boresight.sim.records.selection import GAP_STEPS, Clock
from boresight.sim.rotations import rotation

#: Topics of a file: all, or those of some names and types.
Reader: TypeAlias = Callable[[Path, Collection[str] | None], Recording]
NS = 1e9  #: nanoseconds of a second.
#: Seconds between true values that are bridged; median steps by which a message may be displaced
#: and is sorted, not left out; largest share of messages with stray times that are left out.
_GAP_S, _NEAR_STEPS, _MOST_STRAY = 0.1, 32.0, 0.1
#: Letters of the axes of FLU and ENU, and of the opposite ones: forward, left, up, back, right,
#: down; east, north, up, west, south, down.
_BODY, _NAVIGATION = ("FLU", "BRD"), ("ENU", "WSD")
_NO_SAMPLE = 2**31 - 1  # PX4's delay of a sensor that has no sample (RELATIVE_TIMESTAMP_INVALID)


#: Kinds of messages with irregular times.
_IRREGULAR = (
    "out of order, sorted",
    "that repeat the one before, left out",
    "that share a time with others, spread over the step",
    "with a time far from those around them, left out",
)


def order_of(
    stamps: IntArray, values: FloatArray | None = None
) -> tuple[IntArray, IntArray, tuple[int, ...]]:
    """Messages that are kept, in the order of their times [ns], rising times, and counts of others.

    Messages of one time and equal ``values`` repeat each other; others of one time are spread over
    the step before it. The counts are those of `_IRREGULAR`.
    """
    main = _rising(stamps)
    steps = np.diff(stamps[main])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else NS
    expected = np.interp(np.arange(len(stamps)), np.flatnonzero(main), stamps[main])
    kept = main | (np.abs(stamps - expected) <= _NEAR_STEPS * step)
    index = np.flatnonzero(kept)
    index = index[np.argsort(stamps[index], kind="stable")]
    same = np.zeros(len(index), dtype=bool)
    if values is not None:
        rows = np.column_stack([stamps[index] - stamps[index[:1]], values[index]])
        same[1:] = (np.diff(rows, axis=0) == 0.0).all(axis=1)
    index = index[~same]
    spread = _spread(stamps[index])
    irregular = (kept & ~main, same, spread != stamps[index], ~kept)
    return index, spread, tuple(int(rows.sum()) for rows in irregular)


def _rising(stamps: IntArray) -> BoolArray:
    """A longest part of the messages whose times never fall."""
    if (np.diff(stamps) >= 0).all():
        return np.ones(len(stamps), dtype=bool)
    ends: list[int] = []  # of a part of each length, the least last time
    last: list[int] = []  # and which message that is
    before: list[int] = []
    for k, stamp in enumerate(stamps.tolist()):
        length = bisect_right(ends, stamp)
        before.append(last[length - 1] if length else -1)
        ends[length : length + 1], last[length : length + 1] = [stamp], [k]
    main = np.zeros(len(stamps), dtype=bool)
    k = last[-1]
    while k >= 0:
        main[k], k = True, before[k]
    return main


def _spread(times: IntArray) -> IntArray:
    """Equal times, which follow each other, spread over the step before them."""
    values, group, counts = np.unique(times, return_inverse=True, return_counts=True)
    if len(values) in (0, len(times)):
        return times
    steps = np.diff(values)
    usual = int(np.median(steps)) if len(steps) else int(NS * 1e-3)
    room = np.minimum(np.concatenate([[usual], steps]), usual)
    back = np.cumsum(counts)[group] - 1 - np.arange(len(times))
    return np.asarray(times - room[group] * back // counts[group], dtype=np.int64)


def clock_of(stamps: IntArray) -> Clock:
    """The clock of messages' times [ns], in any order."""
    rows, _, (late, _, repeated, stray) = order_of(stamps)
    clock = Clock.of_steps(np.diff(np.unique(stamps[rows])).astype(np.float64) / NS)
    return replace(clock, samples=len(stamps), repeated=repeated, late=late + stray)


class _Series(NamedTuple):
    """Samples (n, columns) of a source at rising times (n,) [ns]."""

    source: Source
    topic: Topic
    stamps: IntArray
    values: FloatArray
    irregular: tuple[int, ...]


def record_from(path: Path, read: Reader, sources: Sequence[Source]) -> Record:
    """The columns of sources; InputError for a topic or field that is missing or not unique."""
    recording = read(path, {source.label for source in sources})
    notes = list(recording.notes)
    series = list[_Series]()
    for columns in dict.fromkeys(source.columns for source in sources):
        candidates = [source for source in sources if source.columns == columns]
        if (match := _first_match(path, recording, candidates, notes)) is not None:
            series.append(_series(path, *match))
        elif not any(source.optional for source in candidates):
            _refuse_missing(path, read, candidates)
    rows = [s for s in series if s.source.fill == "none" and len(s.stamps)]
    if not rows:
        _refuse_missing(path, read, sources)
    base = max(rows, key=lambda s: len(s.stamps))
    columns_of = {"t": Column((base.stamps - base.stamps[0]) / NS)}
    for s in series:
        table = _in_rows(path, s, base, notes)
        if len(s.stamps) and s.topic is not base.topic and not np.isfinite(table).any():
            what = "hold no number"
            if np.isfinite(s.values).any():
                what = f"are at other times than those of {base.topic.name}: another clock?"
            notes.append(f"{s.topic.name}: its {len(s.stamps)} messages {what}")
        unit = s.source.unit or ("m" if s.source.frame == "geodetic" else None)
        for k, name in enumerate(s.source.columns):
            columns_of[name] = Column(np.ascontiguousarray(table[:, k]), unit)
        counts = zip(_IRREGULAR, s.irregular, strict=True)
        notes += [f"{s.topic.name}: messages {what}: {n}" for what, n in counts if n]
    notes += Clock.of_steps(np.diff(base.stamps) / NS).notes()
    comparison = any(s.source.comparison for s in series)
    once = tuple(dict.fromkeys(notes))
    return Record(name_of(path), columns_of, Place(str(path)), str(path), once, comparison)


def _first_match(
    path: Path, recording: Recording, sources: Sequence[Source], notes: list[str]
) -> tuple[Source, Topic] | None:
    for source in sources:
        topics = [t for t in recording.topics if source.label in (t.name, t.kind) and len(t.stamps)]
        if len(topics) > 1:
            names = ", ".join(sorted(t.name for t in topics))
            wanted = f"one topic of {source.label} for {source.columns[0]}"
            fix = "name one of them in a map: --map FILE.toml"
            require(source.optional, str(path), wanted, names, fix)
            notes.append(f"{source.columns[0]}: one of {names} could be meant, none is read")
        elif topics and _field_names(source, topics[0]) is not None:
            (topic,) = topics
            if _has_sample(source, topic).any():
                return source, topic
            wanted = f"{source.fields[0]} for {source.columns[0]}"
            found = f"no sample in any message, by {source.covariance or source.delay}"
            fix = "record a device that measures it, or name another topic by --map FILE.toml"
            require(source.optional, f"{path}, topic {topic.name}", wanted, found, fix)
            notes.append(f"{topic.name}: no {source.fields[0]}: {found}")
    return None


def _has_sample(source: Source, topic: Topic) -> BoolArray:
    """Messages whose covariance or delay does not say that they have no sample."""
    has_sample = np.ones(len(topic.stamps), dtype=bool)
    for name, none in ((source.covariance, -1.0), (source.delay, _NO_SAMPLE)):
        if name in topic.fields:
            has_sample &= topic.fields[name] != none
    return has_sample


def _field_names(source: Source, topic: Topic) -> list[str] | None:
    """Fields of a source; None if the topic lacks one of them."""
    count, names = len(source.columns), list(source.fields)
    if len(names) < count:
        (path,) = names
        names = [f"{path}[{k}]" for k in range(count)]
        if names[0] not in topic.fields:
            names = [f"{path}.{axis}" for axis in "wxyz"[-count:]]
    time_fields = [name for name in (source.time, source.delay) if name]
    return names if all(name in topic.fields for name in (*names, *time_fields)) else None


def _refuse_missing(path: Path, read: Reader, sources: Sequence[Source]) -> None:
    """InputError for a topic, or for a field of a topic that is there."""
    first, topics = sources[0], read(path, None).topics
    where, name = str(path), first.label
    wanted = f"{'the topic' if first.topic else 'a topic of type'} {name}"
    known: Collection[str] = {t.name if first.topic else t.kind for t in topics}
    for topic in topics:
        if name in (topic.name, topic.kind) and len(topic.stamps):
            where, known = f"{path}, topic {topic.name}", topic.fields
            fields = [*first.fields, *filter(None, (first.time, first.delay))]
            paths = {*known, *(re.split(r"[.[]", f)[0] for f in known)}
            name = next((field for field in fields if field not in paths), fields[0])
            wanted = f"a field {name}"
            break
    found = ", ".join(get_close_matches(name, known, 4, 0.5) or sorted(known)[:8]) or "no topic"
    fix = "record it, or name what is there in a map: --map FILE.toml"
    raise InputError.at(where, wanted=wanted, found=found, fix=fix)


def _series(path: Path, source: Source, topic: Topic) -> _Series:
    where, names = f"{path}, topic {topic.name}", _field_names(source, topic)
    assert names is not None
    values = np.stack([topic.fields[n].astype(np.float64) for n in names], axis=1)
    values *= np.array(source.scale or 1.0)
    values[np.isinf(values)] = np.nan  # no sample is taken from a message that has none
    stamps, has_sample = _times(source, topic)
    stamps, values = stamps[has_sample], values[has_sample]
    rows, times, irregular = order_of(stamps, values)
    if irregular[-1] > _MOST_STRAY * len(stamps):
        row = int(np.argmax(np.diff(stamps) < 0)) + 1
        found = f"a clock that steps back by {(stamps[row - 1] - stamps[row]) / NS:.6g} s"
        where, fix = f"{where}, message {row}", "cut the recording there"
        raise InputError.at(where, wanted="times that rise", found=found, fix=fix)
    return _Series(source, topic, times, _in_record_frame(where, source, values[rows]), irregular)


def _times(source: Source, topic: Topic) -> tuple[IntArray, BoolArray]:
    """Times of the samples [ns], and which messages have a sample of their own."""
    has_sample = _has_sample(source, topic)
    if not source.time and not source.delay:
        return topic.stamps, has_sample
    raw, unit = topic.fields[source.time or source.delay], TIME_UNITS[source.time_unit]
    is_whole = raw.dtype.kind != "f"
    stamps = raw.astype(np.int64) * int(unit) if is_whole else np.rint(raw * unit).astype(np.int64)
    if source.time:
        return stamps, has_sample
    stamps = topic.stamps + stamps
    # A fast message repeats the last sample of a slow sensor.
    has_sample[1:] &= stamps[1:] != stamps[:-1]
    return stamps, has_sample


def _in_record_frame(where: str, source: Source, values: FloatArray) -> FloatArray:
    if source.frame in ("", "none"):
        return values
    if source.frame == "geodetic":
        first = values[np.argmax(np.isfinite(values).all(axis=1))]
        return np.stack(optional("pymap3d").geodetic2enu(*values.T, *first), axis=1)
    body, _, navigation = source.frame.partition(" to ")
    if not navigation:
        matrix = _matrix(where, body, _BODY, _NAVIGATION)
        axis = np.abs(matrix).argmax(axis=1)  # no sum of products: a missing component stays alone
        return np.asarray(values[:, axis] * matrix.sum(axis=1))
    # v_enu = N v_n, v_b = B^T v_flu: q_enu_flu = q_N q q_B*.
    left = rotation.matrix_to_quaternion(_matrix(where, navigation, _NAVIGATION))
    right = rotation.matrix_to_quaternion(_matrix(where, body, _BODY).T)
    return rotation.quaternion_multiply(rotation.quaternion_multiply(left, values), right)


def _matrix(where: str, name: str, *letters: tuple[str, str]) -> FloatArray:
    """Columns: the axes of ``name`` in FLU or ENU."""
    for axes, opposite in letters:
        if len(name) == 3 and set(name) <= {*axes, *opposite}:
            signs = [1.0 if x in axes else -1.0 for x in name]
            matrix = np.eye(3)[:, [(axes + opposite).index(x) % 3 for x in name]] * signs
            if np.linalg.det(matrix) > 0.5:
                return matrix
    wanted = f"three letters of {' or '.join(map(''.join, letters))} for right-handed axes"
    fix = "name the frame of the file, as FRD or NED"
    raise InputError.at(where, wanted=wanted, found=repr(name), fix=fix)


def _in_rows(path: Path, s: _Series, base: _Series, notes: list[str]) -> FloatArray:
    """Values in the rows, NaN where missing."""
    rows = base.stamps
    out = np.full((len(rows), s.values.shape[1]), np.nan)
    if not len(s.stamps):
        return out
    if s.source.fill == "linear":
        return _interpolated(s, rows, out)
    if s.source.fill == "hold":
        last = np.searchsorted(s.stamps, rows, "right") - 1
        return np.where((last < 0)[:, None], np.nan, s.values[last])
    row = np.searchsorted(rows, s.stamps)
    step = (rows[-1] - rows[0]) / max(len(rows) - 1, 1)
    inside = (row < len(rows)) & (s.stamps > rows[0] - GAP_STEPS * step)
    name, base_name, outside = s.topic.name, base.topic.name, int((~inside).sum())
    ahead = float(s.stamps[0] - rows[0]) / NS
    found = f"none of {outside}: its clock is {abs(ahead):.6g} s "
    found += "ahead" if ahead > 0.0 else "behind"
    fix = "correct its time stamps (a 32-bit counter of microseconds wraps after 4294.97 s)"
    wanted = f"samples at the times of {base_name}"
    require(bool(inside.any()), f"{path}, topic {name}", wanted, found, fix)
    if outside:
        notes.append(f"{name}: samples before or after those of {base_name}, left out: {outside}")
    out[row[inside]] = s.values[inside]
    behind = inside & (row > 0)
    if passed := int(behind.sum() - len(np.unique(row[behind]))):
        notes.append(f"{name}: {passed} samples dropped, a newer one falls into the same row")
    return out


def _interpolated(s: _Series, rows: IntArray, out: FloatArray) -> FloatArray:
    """Values between two samples that are near enough."""
    stamps, values = s.stamps, s.values
    if len(stamps) < 2:
        return out
    attitude = " to " in s.source.frame
    if attitude:  # one sign from sample to sample
        flipped = (values[1:] * values[:-1]).sum(axis=1) < 0.0
        values = values.copy()
        values[1:] *= np.cumprod(np.where(flipped, -1.0, 1.0))[:, None]
    upper = np.clip(np.searchsorted(stamps, rows), 1, len(stamps) - 1)
    gap = stamps[upper] - stamps[upper - 1]
    share = ((rows - stamps[upper - 1]) / gap)[:, None]
    valid = (share[:, 0] >= 0.0) & (share[:, 0] <= 1.0) & (gap / NS <= _GAP_S)
    interpolated = (1.0 - share) * values[upper - 1] + share * values[upper]
    if attitude:
        valid &= np.abs(np.linalg.norm(interpolated, axis=1) - 1.0) < 0.1
        interpolated[valid] = rotation.quaternion_normalise(interpolated[valid])
    out[valid] = interpolated[valid]
    return out
