"""A record of a recording: rows at the times of its fastest sensor.

A sample of a slower sensor stands in the first row at or after its own time; rows between have
none. True values are interpolated to the rows. Samples that are not later than all before them are
left out, and counted.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.errors import InputError
from boresight.sim.attitude.rotation import quaternion_normalise
from boresight.sim.records.frames import attitude_from, vector_from
from boresight.sim.records.maps import TIME_UNITS, Source
from boresight.sim.records.record import Column, Record, index_place, name_of
from boresight.sim.records.topics import NS, Clock, Recording, Topic, increasing

__all__ = ["Reader", "record_from"]

#: Topics of a file: all, or those of some names and types.
Reader: TypeAlias = Callable[[Path, Collection[str] | None], Recording]

#: Seconds between two true values that are bridged.
_GAP_S = 0.1
_NO_SAMPLE = -(2**31)  # PX4's delay of a sensor that has no sample


@dataclass(frozen=True, eq=False)
class _Series:
    """Samples of a source at rising times [ns], (n, columns)."""

    source: Source
    topic: Topic
    stamps: IntArray
    values: FloatArray
    clock: Clock


def record_from(path: Path, read: Reader, sources: Sequence[Source]) -> Record:
    """Return the columns of sources.

    Raises
    ------
    InputError
        The file is damaged; a topic or a field is not there; several topics could be meant.
    ToolMissing
        What reads the file is not installed.
    """
    recording = read(path, {source.wanted for source in sources})
    notes = list(recording.notes)
    series: list[_Series] = []
    for columns in dict.fromkeys(source.columns for source in sources):
        several = [source for source in sources if source.columns == columns]
        picked = _picked(path, recording, several, notes)
        if picked is not None:
            series.append(_series(path, *picked))
        elif not any(source.optional for source in several):
            _refuse_missing(path, read, several)
    rows = [s for s in series if s.source.fill == "none" and len(s.stamps)]
    if not rows:
        _refuse_missing(path, read, sources)
    base = max(rows, key=lambda s: len(s.stamps))
    columns_of = {"t": Column((base.stamps - base.stamps[0]) / NS)}
    for s in series:
        table = _in_rows(s, base, notes)
        unit = s.source.unit or ("m" if s.source.frame == "geodetic" else None)
        for k, name in enumerate(s.source.columns):
            columns_of[name] = Column(np.ascontiguousarray(table[:, k]), unit)
    notes += dict.fromkeys(text for s in series for text in s.clock.notes(s.topic.name, s is base))
    comparison = any(s.source.comparison for s in series)
    return Record(
        name_of(path), columns_of, index_place(str(path)), str(path), tuple(notes), comparison
    )


def _picked(
    path: Path, recording: Recording, sources: Sequence[Source], notes: list[str]
) -> tuple[Source, Topic] | None:
    """The first source that the recording has."""
    for source in sources:
        topics = [
            t for t in recording.topics if source.wanted in (t.name, t.kind) and len(t.stamps)
        ]
        if len(topics) > 1:
            names = ", ".join(sorted(t.name for t in topics))
            if not source.optional:
                raise InputError.at(
                    str(path),
                    wanted=f"one topic of {source.wanted} for {source.columns[0]}",
                    found=names,
                    fix="name one of them in a map: --map FILE.toml",
                )
            notes.append(f"{source.columns[0]}: one of {names} could be meant, none is read")
        elif topics and _names(source, topics[0]) is not None:
            return source, topics[0]
    return None


def _names(source: Source, topic: Topic) -> list[str] | None:
    """Fields of a source; None if the topic lacks one of them."""
    count, names = len(source.columns), list(source.fields)
    if len(names) < count:
        (path,) = names
        names = [f"{path}[{k}]" for k in range(count)]
        if names[0] not in topic.fields:
            names = [f"{path}.{axis}" for axis in "wxyz"[-count:]]
    more = [name for name in (source.time, source.delay) if name]
    return names if all(name in topic.fields for name in (*names, *more)) else None


def _refuse_missing(path: Path, read: Reader, sources: Sequence[Source]) -> None:
    """InputError for a topic, or for a field of a topic that is there."""
    first, topics = sources[0], {t.name: t for t in read(path, None).topics}
    for topic in topics.values():
        if first.wanted in (topic.name, topic.kind) and len(topic.stamps):
            fields = [*first.fields, *filter(None, (first.time, first.delay))]
            raise InputError.at(
                f"{path}, topic {topic.name}",
                wanted=f"fields {', '.join(fields)}",
                found=_near(fields[0], topic.fields),
                fix="name what is there in a map: --map FILE.toml",
            )
    names = topics if first.topic else {t.kind for t in topics.values()}
    raise InputError.at(
        str(path),
        wanted=f"{'the topic' if first.topic else 'a topic of type'} {first.wanted}",
        found=_near(first.wanted, names),
        fix="record it, or name another in a map: --map FILE.toml",
    )


def _near(name: str, names: Collection[str]) -> str:
    near = get_close_matches(name, names, 4, 0.5)
    return ", ".join(near or sorted(names)[:8]) or "no topic"


def _series(path: Path, source: Source, topic: Topic) -> _Series:
    where, names = f"{path}, topic {topic.name}", _names(source, topic)
    assert names is not None
    values = np.stack([topic.fields[n].astype(np.float64) for n in names], axis=1)
    if source.scale:
        values = values * np.array(source.scale)
    values[np.isinf(values)] = np.nan  # no sample is taken from a message that has none
    stamps, some = _times(source, topic)
    clock, rising = Clock.of(stamps[some]), increasing(stamps[some])
    stamps, values = stamps[some][rising], values[some][rising]
    return _Series(source, topic, stamps, _turned(where, source, values), clock)


def _times(source: Source, topic: Topic) -> tuple[IntArray, BoolArray]:
    """Times of the samples [ns], and which messages have a sample of their own."""
    every = np.ones(len(topic.stamps), dtype=bool)
    if not source.time and not source.delay:
        return topic.stamps, every
    raw: npt.NDArray[Any] = topic.fields[source.time or source.delay]
    unit = TIME_UNITS[source.time_unit]
    own = np.rint(raw * unit).astype(np.int64) if raw.dtype.kind == "f" else raw.astype(np.int64)
    own = own if raw.dtype.kind == "f" else own * int(unit)
    if source.time:
        return own, every
    every = raw != _NO_SAMPLE
    own = topic.stamps + own
    # A fast message repeats the last sample of a slow sensor.
    every[1:] &= own[1:] != own[:-1]
    return own, every


def _turned(where: str, source: Source, values: FloatArray) -> FloatArray:
    """Values in the frames of records."""
    if source.frame in ("", "none"):
        return values
    if source.frame == "geodetic":
        known = np.isfinite(values).all(axis=1)
        if not known.any():
            return values
        from pymap3d import geodetic2enu  # a tenth of a second

        first = values[np.argmax(known)]
        return np.stack(geodetic2enu(*values.T, *first), axis=1)
    if " to " not in source.frame:
        return vector_from(where, source.frame, values)
    return attitude_from(where, source.frame, values)


def _in_rows(s: _Series, base: _Series, notes: list[str]) -> FloatArray:
    """Values in the rows, NaN where missing."""
    rows = base.stamps
    out = np.full((len(rows), s.values.shape[1]), np.nan)
    if not len(s.stamps):
        return out
    if s.source.fill == "linear":
        return _between(s, rows, out)
    if s.source.fill == "hold":
        last = np.searchsorted(s.stamps, rows, "right") - 1
        out[last >= 0] = s.values[last[last >= 0]]
        return out
    at = np.searchsorted(rows, s.stamps)
    inside = at < len(rows)
    out[at[inside]] = s.values[inside]
    behind = inside & (at > 0)
    if passed := int(behind.sum() - len(np.unique(at[behind]))):
        notes.append(f"{s.topic.name}: samples passed by a later one of the same row: {passed}")
    return out


def _between(s: _Series, rows: IntArray, out: FloatArray) -> FloatArray:
    """Values between two samples that are near enough."""
    own, values = s.stamps, s.values
    if len(own) < 2:
        return out
    attitude = " to " in s.source.frame
    if attitude:  # one sign from sample to sample
        turned = (values[1:] * values[:-1]).sum(axis=1) < 0.0
        values = values.copy()
        values[1:] *= np.cumprod(np.where(turned, -1.0, 1.0))[:, None]
    after = np.clip(np.searchsorted(own, rows), 1, len(own) - 1)
    gap = own[after] - own[after - 1]
    share = ((rows - own[after - 1]) / gap)[:, None]
    known = (share[:, 0] >= 0.0) & (share[:, 0] <= 1.0) & (gap / NS <= _GAP_S)
    between = (1.0 - share) * values[after - 1] + share * values[after]
    if attitude:
        known &= np.abs(np.linalg.norm(between, axis=1) - 1.0) < 0.1
        between[known] = quaternion_normalise(between[known])
    out[known] = between[known]
    return out
