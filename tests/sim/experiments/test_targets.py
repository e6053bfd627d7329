"""Targets from a table: figures, ratios, differences, limits that are not there, notes."""

from pathlib import Path

import pytest

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.targets import targets_of

TABLE = """figure,over,less,source,name,low,high,prototype,unit,note,reported
a,,,step 1,"plain, x",,0.5,0.25,deg,,
a,b,,step 2,ratio,0.1,,,,and so,
a,,b,step 3,difference,-4,-3,,,because,yes
b,,,step 4,shown,,,,s,,
"""


def table(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, **given
) -> tuple[Target, ...]:
    (tmp_path / "targets.csv").write_text(text)
    monkeypatch.setattr("boresight.sim.experiments.targets.files", lambda package: tmp_path)
    return targets_of("any", {"a": 1.0, "b": 4.0}, **given)


def test_rows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    spreads = {"a": (0.5, 2.0)}
    found = table(monkeypatch, tmp_path, TABLE, spreads=spreads)
    named = {"source": "step 1", "unit": "deg", "beside": {"prototype": 0.25}}
    assert found == (
        Target(name="plain, x", value=1.0, high=0.5, spread=(0.5, 2.0), **named),
        Target(name="ratio", source="step 2", value=0.25, low=0.1, note="and so"),
        Target(
            name="difference",
            source="step 3",
            value=-3.0,
            low=-4.0,
            high=-3.0,
            binding=False,
            note="because",
        ),
        Target(name="shown", source="step 4", value=4.0, unit="s"),
    )
    assert [t.good for t in found] == [False, True, True, True]


def test_columns_that_may_be_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    text = "figure,source,name,low,high\nb,ours,one,3,\n"
    assert table(monkeypatch, tmp_path, text) == (
        Target(name="one", source="ours", value=4.0, low=3.0),
    )
