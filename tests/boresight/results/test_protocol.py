"""What a protocol found, as fields, as text and as a table."""

from __future__ import annotations

from pathlib import Path

from boresight.results.protocol import ProtocolNear, ProtocolResult, ProtocolWorst

ANGLES = {"total": 2.0, "heading": 1.5, "inclination": 1.0}
SETTLED = {"settled_2": None, "never_2": 1.0, "settled_5": 3.5, "never_5": 0.0}
WORST = {"ratio": 1.5, "trial": "a", "case": "place 1"}
OURS = {**ANGLES, **SETTLED, "ratio": 0.5, "inclination_ratio": 0.75, "worst": WORST}
RIVAL = {"total": 4.0, "heading": None, "inclination": 2.0, **SETTLED}
DATA = {
    "protocol": "short",
    "word": 24,
    "trial_names": ["a", "b"],
    "filters": ["mine", "vqf_online"],
    "rival": "vqf_online",
    "groups": [
        {
            "group": "anywhere",
            "judged": "total",
            "runs": 4,
            "rows": {"mine": OURS, "vqf_online": RIVAL},
        }
    ],
    "fixed": [
        {
            "estimator": "mine",
            "apart_deg": 2e-4,
            "where": "a, place 1",
            "changed": 0,
            "saturated": 0,
            "good": True,
        }
    ],
    "refused": [],
    "good": True,
}
RESULT = ProtocolResult.of(DATA, Path("out/accuracy-short.html"))


def test_fields() -> None:
    assert (RESULT.protocol, RESULT.word, RESULT.good) == ("short", 24, True)
    (group,) = RESULT.groups
    ours, rival = group.rows
    assert (group.group, group.judged, group.runs) == ("anywhere", "total", 4)
    assert ours.mean_deg == ANGLES and ours.settled_s == {2.0: None, 5.0: 3.5}
    assert (ours.ratio, ours.inclination_ratio) == (0.5, 0.75)
    assert ours.worst == ProtocolWorst(1.5, "a", "place 1")
    assert (rival.ratio, rival.worst, rival.mean_deg["heading"]) == (None, None, None)
    assert RESULT.fixed == (ProtocolNear("mine", 2e-4, "a, place 1", 0, 0, True),)


def test_text_data_and_table() -> None:
    assert "anywhere" in str(RESULT) and "mine against vqf_online" in str(RESULT)
    assert RESULT.to_json() == DATA | {"file": "out/accuracy-short.html"}
    page = RESULT._repr_html_()
    assert "<td>anywhere</td><td>4</td><td>mine</td>" in page and "a, place 1" in page
