"""Result of `boresight accuracy --protocol`, and its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.attitude.robustness.runs import SETTLED_DEG
from boresight.sim.attitude.robustness.summary import text

__all__ = ["ProtocolGroup", "ProtocolNear", "ProtocolResult", "ProtocolRow", "ProtocolWorst"]


@dataclass(frozen=True)
class ProtocolWorst:
    """The single run that compares worst with the rival's: ratio of the judged figure, where."""

    ratio: float
    trial: str
    case: str


@dataclass(frozen=True)
class ProtocolRow:
    """One filter in one group of cases.

    Attributes
    ----------
    filter : str
        Its name, with " float64" behind it for that level.
    mean_deg : mapping of str to float or None
        ``total``, ``heading``, ``inclination``: root mean square errors, means over trials and
        cases.
    settled_s : mapping of float to float or None
        By limit in degrees: median time until the error stays below; None: never.
    ratio, inclination_ratio : float or None
        Of the means of the judged figure, and of the inclination, to the rival's.
    worst : ProtocolWorst or None
    """

    filter: str
    mean_deg: Mapping[str, float | None]
    settled_s: Mapping[float, float | None]
    ratio: float | None
    inclination_ratio: float | None
    worst: ProtocolWorst | None

    @classmethod
    def of(cls, name: str, row: Mapping[str, Any]) -> ProtocolRow:
        """From the row of a summary."""
        return cls(
            name,
            {angle: row[angle] for angle in ANGLES},
            {limit: row[f"settled_{limit:g}"] for limit in SETTLED_DEG},
            row.get("ratio"),
            row.get("inclination_ratio"),
            ProtocolWorst(**row["worst"]) if "worst" in row else None,
        )


@dataclass(frozen=True)
class ProtocolGroup:
    """Cases that are reported together: what is judged, how many runs, each filter."""

    group: str
    judged: str
    runs: int
    rows: tuple[ProtocolRow, ...]


@dataclass(frozen=True)
class ProtocolNear:
    """Fixed point against float64 over every sample of every run.

    Attributes
    ----------
    estimator : str
    apart_deg : float
        Largest angle between the attitudes.
    where : str
        In which trial and case.
    changed, saturated : int
        Status words that differ, updates that saturated.
    good : bool
        As near as the outputs' tolerances say.
    """

    estimator: str
    apart_deg: float
    where: str
    changed: int
    saturated: int
    good: bool


@dataclass(frozen=True)
class ProtocolResult(Answer):
    """What `boresight.accuracy_protocol` gives.

    Attributes
    ----------
    protocol : str
    word : int
        Word width, bits.
    good : bool
        Fixed point is as near to float64 as the outputs' tolerances say, and nothing saturated.
    trials, filters : tuple of str
    rival : str or None
        The published filter that others are compared with, where it ran.
    groups : tuple of ProtocolGroup
    fixed : tuple of ProtocolNear
    page : Path
        The page, with curves of single runs that are worse than the rival's.
    report : mapping
        Contents of ``accuracy-PROTOCOL.json``.
    """

    protocol: str
    word: int
    good: bool
    trials: tuple[str, ...]
    filters: tuple[str, ...]
    rival: str | None
    groups: tuple[ProtocolGroup, ...]
    fixed: tuple[ProtocolNear, ...]
    page: Path
    report: JsonObject = field(repr=False)

    @classmethod
    def of(cls, data: dict[str, Any], page: Path) -> ProtocolResult:
        """From the contents of the JSON."""
        return cls(
            protocol=data["protocol"],
            word=data["word"],
            good=data["good"],
            trials=tuple(data["trial_names"]),
            filters=tuple(data["filters"]),
            rival=data["rival"],
            groups=tuple(
                ProtocolGroup(
                    g["group"],
                    g["judged"],
                    g["runs"],
                    tuple(ProtocolRow.of(name, row) for name, row in g["rows"].items()),
                )
                for g in data["groups"]
            ),
            fixed=tuple(ProtocolNear(**row) for row in data["fixed"]),
            page=page,
            report=data,
        )

    def to_json(self) -> JsonObject:
        """The contents of the JSON, and where the page is (``file``)."""
        return self.report | {"file": str(self.page)}

    def _shown(self) -> JsonObject:
        rows = [
            {"group": g.group, "runs": g.runs, **vars(row)} for g in self.groups for row in g.rows
        ]
        head = ("protocol", "word", "good", "rival", "page")
        return {
            **{name: plain(getattr(self, name)) for name in head},
            "groups": plain(rows),
            "fixed": plain(self.fixed),
        }

    def __str__(self) -> str:
        return text(self.report)
