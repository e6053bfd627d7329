"""`boresight fit`: a profile that all verbs find."""

from __future__ import annotations

from pathlib import Path


def test_a_profile(here: Path, data, said) -> None:
    source = Path("mine.py")
    wide = source.read_text().replace('"vel", -32.0, 32.0', '"vel", -4096.0, 4096.0')
    source.write_text(wide)
    check = "check mine.py mine.csv --levels c --word 22 --tolerance pos=1 --tolerance vel=1"
    before = data(check)["results"][0]["accuracy"]["outputs"]
    found = data("fit mine.py mine.csv --word 22")
    place = Path(found["profile"])
    assert place.exists() and [e["output"] for e in found["errors"]] == ["pos", "vel"]
    after = data(check)["results"][0]["accuracy"]["outputs"]
    without = data(f"{check} --profile none")["results"][0]
    assert without["accuracy"]["outputs"] == before
    for error, output in zip(found["errors"], after, strict=True):
        assert error["after"] == output["max"] < error["before"]
    assert "not written" in said("fit mine.py mine.csv -o own.json -q")
    assert not Path("own.json").exists()


def test_a_log_that_restarts(here: Path, data) -> None:
    """A sum that grows by 1 in each row, and begins anew in every fourth: at most 4, in [-8, 8]."""
    Path("total.py").write_text(
        "from boresight import Estimator, Input, Output, State\n"
        "class Total(Estimator):\n"
        "    inputs = (Input('a', 0.0, 1.0),)\n"
        "    states = (State('s', -8.0, 8.0),)\n"
        "    outputs = (Output('y', '', 1e-6),)\n"
        "    def step(self, x, u, p):\n"
        "        return {'s': x.s + u.a}, {'y': x.s + u.a}\n"
    )
    rows = [f"1,{k % 4 // 3}" for k in range(1, 201)]
    Path("total.csv").write_text("\n".join(["a,restart", *rows]) + "\n")
    found = data("fit total.py total.csv")
    assert found["saturated_updates"] == 0 and found["errors"][0]["after"] == 0.0


def test_logs_of_one_name(here: Path, data) -> None:
    for name in ("x/a 3.csv", "y/a.csv", "z/a.csv"):
        Path(name).parent.mkdir()
        Path(name).write_bytes(Path("mine.csv").read_bytes())
    names = ["a 3", "y/a", "z/a", "y/a 4"]
    assert [*data("fit mine.py x y z y/a.csv")["records"]] == names


def test_refused(here: Path, refused) -> None:
    assert "at least one log or world" in refused("fit mine.py")
    assert "nosuch.csv" in refused("fit mine.py nosuch.csv")
