"""Area: words of 18 bits take one multiplier block of the XC6SLX9, wider ones four."""

from boresight.sim.explore.measure import Case, Exploration, Task, measured
from tests.support.smooth import LOG, Smooth


def test_area_of_18_bits() -> None:
    (row,) = measured(
        Exploration((LOG,)), [Task("k", "area", Case(Smooth, (), 18, "small", "xc6slx9"))]
    )
    assert row["key"] == "k" and row["dsp"] == 1 and row["fits"] is True
    assert 200 < row["lut"] < 400 and row["clock"] > 50.0


def test_a_tool_that_fails_is_worth_another_try(monkeypatch) -> None:
    from boresight.gateware.synthesis.yosys import SynthesisError

    def fail(*_, **__):
        raise SynthesisError("no memory\nmore")

    monkeypatch.setattr("boresight.sim.explore.measure.estimate", fail)
    case = Case(Smooth, (), 18, "small", "xc6slx9")
    (row,) = measured(Exploration((LOG,)), [Task("k", "area", case)])
    assert row == {"key": "k", "refused": "no memory", "again": True}
