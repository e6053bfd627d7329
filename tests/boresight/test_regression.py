"""A filter that got worse fails beside its earlier result."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import boresight
from boresight.model.errors import InputError

#: A product more costs cycles; another gain costs accuracy, or is told by its name or its values.
CHANGES = {
    "compile mine.py -o build": (
        "ahead + p.alpha * innovation",
        "ahead + p.alpha * innovation * (1.0 + 0.001 * innovation)",
        "worse than before.json: pos: latency ",
    ),
    "check mine.py mine.csv --levels fixed,c": (
        '"alpha", 0.3',
        '"alpha", 0.301',
        "not as in before.json: mine, alpha: value 0.3 -> 0.301, and ",
    ),
    "check mine.py mine.csv --levels c,fixed": (
        "x.vel + p.beta",
        "x.vel + 1.001 * p.beta",
        "not as in before.json: mine, vel, step 0: float64 0.13 -> 0.13013 m/s\n",
    ),
    "check mine.py mine.csv --levels c": (
        "    params = (",
        '    waived = ("gate",)\n    params = (',
        "worse than before.json: mine, gate: waived 0 -> 1\n",
    ),
    "check mine.py mine.csv --levels fixed": (
        "truth=0.05",
        "truth=5.0",
        "not as in before.json: mine, pos: limit of the error from the truth 0.05 -> 5.0 m\n",
    ),
    "accuracy mine.py mine.csv": (
        "ahead + p.alpha",
        "ahead + 2.5 * p.alpha",
        "worse than before.json: mine, fixed, vel: error from the truth",
    ),
}


@pytest.mark.parametrize("line", CHANGES)
def test_a_worse_filter_fails(line: str, here: Path, data, said) -> None:
    Path("before.json").write_text(json.dumps(data(line)))
    assert data(f"{line} --baseline before.json")["baseline"]["changes"] == []
    source = Path("mine.py")
    old, new, failure = CHANGES[line]
    assert old in source.read_text()
    source.write_text(source.read_text().replace(old, new))
    text = said(f"{line} --baseline before.json -q", 1)
    assert f"\nFAILED: {failure}" in text


def test_another_rounding_within_the_tolerance_passes(here: Path, data, said) -> None:
    """A wider state costs bits: the program has changed, and nothing is worse."""
    line = "check mine.py mine.csv --levels fixed,c"
    Path("before.json").write_text(json.dumps(data(line)))
    source = Path("mine.py")
    wider = source.read_text().replace('State("pos", -128.0, 128.0', 'State("pos", -4096.0, 4096.0')
    source.write_text(wider)
    assert "program digest has changed" in said(f"{line} --baseline before.json -q")


def test_an_earlier_result_may_come_from_a_pipe(here: Path, data) -> None:
    """Which gives its text once, as bash's <(git show main:before.json)."""
    line = "check mine.py mine.csv --levels fixed"
    pipe, end = os.pipe()
    os.write(end, json.dumps(data(line)).encode())
    os.close(end)
    assert data(f"{line} --baseline /dev/fd/{pipe}")["baseline"]["changes"] == []
    os.close(pipe)


def test_of_another_verb(here: Path) -> None:
    with pytest.raises(InputError, match="wanted a result of check, compile or accuracy"):
        boresight.baseline(boresight.info("mine.py"), "mine_baseline.json")
    result = boresight.check("mine.py", "mine.csv", levels=["c"])
    Path("other.json").write_text("{}")
    with pytest.raises(InputError, match="other.json: wanted an earlier result"):
        boresight.baseline(result, "other.json")


def test_what_passes_and_what_is_told(here: Path, data, said, refused) -> None:
    """Other numerics pass, also of outputs without a tolerance; other logs and units are told."""
    line = "check mine.py mine.csv --levels fixed"
    source = Path("mine.py")
    bare = source.read_text().replace('"m/s", tolerance=1e-4, truth=0.5', '"m/s"')
    source.write_text(bare)
    earlier = data(line)
    Path("before.json").write_text(json.dumps(earlier))
    source.write_text(bare.replace("ahead + p.alpha * innovation", "p.alpha * innovation + ahead"))
    said(f"{line} --baseline before.json -q")
    source.write_text(bare.replace('Output("vel", "m/s"', 'Output("vel", "km/s"'))
    assert "vel: unit m/s -> km/s" in said(f"{line} --baseline before.json -q", 1)
    source.write_text(bare)
    Path("other.csv").write_bytes(Path("mine.csv").read_bytes())
    other = line.replace("mine.csv", "other.csv")
    assert "wanted results of mine on other" in refused(f"{other} --baseline before.json -q")
    for output in earlier["results"][0]["accuracy"]["outputs"]:
        output.pop("float64", None)
    Path("before.json").write_text(json.dumps(earlier))
    assert "has no values of float64" in said(f"{line} --baseline before.json -q")
