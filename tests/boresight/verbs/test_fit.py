"""`boresight fit`: a profile that all verbs find."""

from __future__ import annotations

from pathlib import Path


def test_a_profile(here: Path, data, said) -> None:
    source = Path("mine.py")
    wide = source.read_text().replace('"vel", -32.0, 32.0', '"vel", -4096.0, 4096.0')
    source.write_text(wide)
    before = data("check mine.py mine.csv --levels c")["results"][0]["accuracy"]["outputs"]
    found = data("fit mine.py mine.csv")
    place = Path(found["profile"])
    assert place.exists() and [e["output"] for e in found["errors"]] == ["pos", "vel"]
    after = data("check mine.py mine.csv --levels c")["results"][0]["accuracy"]["outputs"]
    without = data("check mine.py mine.csv --levels c --profile none")["results"][0]
    assert without["accuracy"]["outputs"] == before
    for error, output in zip(found["errors"], after, strict=True):
        assert error["after"] == output["max"] <= error["before"]
    assert "formats of" in said("fit mine.py mine.py mine.csv -o own.json -q")


def test_refused(here: Path, refused) -> None:
    assert "at least one log or world" in refused("fit mine.py")
    assert "nosuch.csv" in refused("fit mine.py nosuch.csv")
