"""`boresight fit`: a profile that all verbs find; `tune`: parameters that all verbs take."""

from __future__ import annotations

import json
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


def test_tuned_parameters(here: Path, data, refused) -> None:
    found = data("tune mine.py mine.csv -o tuned.json --rounds 2 --only beta")
    assert [p["parameter"] for p in found["tuned_parameters"]] == ["beta"]
    assert json.loads(Path("tuned.json").read_text())["parameters"] == found["parameters"]
    error = data("run mine.py mine.csv --param @tuned.json")["truth"]
    assert error[1]["rms"] < data("run mine.py mine.csv")["truth"][1]["rms"]
    assert "gamma" in refused("tune mine.py mine.csv --only gamma")
