"""What a flight log or a bag has: topics, fields, units, rates, gaps, times.

boresight topics flight.ulg  # each topic with its fields
boresight topics bag --json  # a bag of ROS 2 is a folder
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from boresight.model.errors import InputError
from boresight.options import Option, Verb
from boresight.sim.answer import Answer
from boresight.sim.records.files import RECORDINGS, recording_of
from boresight.sim.records.maps import Source, ready_map
from boresight.sim.records.topics import NS, Clock, Topic

__all__ = ["TopicFigures", "TopicsResult", "topics"]


@dataclass(frozen=True)
class TopicFigures:
    """A topic of a recording.

    Attributes
    ----------
    name, kind : str
        Name, and type of its messages.
    fields : tuple of str
        Numbers of each message; vectors as ``q[0..3]``.
    units : dict of str to str
        Units and frames of fields, where a ready map tells them.
    first_s, last_s : float or None
        Times of the first and the last message, from the first of the file on.
    clock : Clock
        Messages, rate, jitter, gaps, times that repeat or step back.
    """

    name: str
    kind: str
    fields: tuple[str, ...]
    units: dict[str, str]
    first_s: float | None
    last_s: float | None
    clock: Clock


@dataclass(frozen=True)
class TopicsResult(Answer):
    """What `topics` gives: the topics of a file by name, and what is odd about it."""

    file: str
    topics: tuple[TopicFigures, ...]
    notes: tuple[str, ...]

    def __str__(self) -> str:
        width = max((len(t.name) for t in self.topics), default=5)
        lines = [
            f"{'topic':{width}s}  messages   rate Hz jitter ms   first s    last s   gaps "
            "longest s  twice  back"
        ]
        for t in self.topics:
            c = t.clock
            rate = "-" if c.rate_hz is None else f"{c.rate_hz:.4g}"
            times = ("-" if x is None else f"{x:.3f}" for x in (t.first_s, t.last_s))
            lines += [
                f"{t.name:{width}s} {c.samples:9d} {rate:>9s} {1e3 * c.jitter_s:9.3g} "
                + " ".join(f"{x:>9s}" for x in times)
                + f" {c.gaps:6d} {c.longest_s:9.3g} {c.repeated:6d} {c.late:5d}",
                f"  {'' if t.kind == t.name else f'{t.kind}: '}"
                + ", ".join(f"{f} {t.units[f]}" if f in t.units else f for f in t.fields),
            ]
        return "\n".join((*lines, *(f"warning: {text}" for text in self.notes)))


def topics(file: Annotated[str | Path, Option(metavar="FILE")]) -> TopicsResult:
    """List the topics of a flight log or a bag.

    Parameters
    ----------
    file : path
        ``.ulg``, ``.bag``, ``.mcap``, ``.db3``, or the folder of a bag of ROS 2.

    Returns
    -------
    TopicsResult
        Topics by name.

    Raises
    ------
    InputError
        Another file, or a damaged one.
    ToolMissing
        What reads it is not installed.
    """
    path = Path(file)
    recording = recording_of(path)
    if recording is None:
        raise InputError.at(
            str(path),
            wanted=f"a flight log or a bag: {', '.join(RECORDINGS)}, or the folder of a bag",
            found="another file" if path.exists() else "none",
            fix="a table has its columns in its header",
        )
    read, ready = recording
    held = read(path, None)
    starts = [int(t.stamps.min()) for t in held.topics if len(t.stamps)]
    start = min(starts, default=0)
    every = sorted(held.topics, key=lambda t: t.name)
    figures = (_figures(topic, start, ready_map(ready)) for topic in every)
    return TopicsResult(str(path), tuple(figures), held.notes)


def _figures(topic: Topic, start: int, sources: Iterable[Source]) -> TopicFigures:
    fields, units = _shortened(topic.fields), {}
    for s in sources:
        if s.label in (topic.name, topic.kind) and s.frame != "geodetic":
            text = " ".join(filter(None, (s.unit, s.frame and f"({s.frame})")))
            for name in fields:
                if re.split(r"\[|\.[wxyz]$", name)[0] in s.fields or name in s.fields:
                    units[name] = text
    known = len(topic.stamps) > 0
    first, last = (
        ((int(x) - start) / NS for x in (topic.stamps.min(), topic.stamps.max()))
        if known
        else (None, None)
    )
    clock = Clock.of(topic.stamps)
    return TopicFigures(topic.name, topic.kind, tuple(fields), units, first, last, clock)


def _shortened(names: Iterable[str]) -> list[str]:
    """Fields with the elements of an array as one: ``q[0..3]``."""
    last: dict[str, str] = {}
    for name in names:
        path, bracket, index = name.partition("[")
        last[path] = f"{path}[0..{index}" if bracket and index != "0]" else name
    return list(last.values())


VERB = Verb(topics)
