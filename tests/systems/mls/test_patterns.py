"""Patterns of displaced elements against the closed form, and what the paper's figures show."""

import pytest

from boresight.systems.mls.linear_array import Array
from boresight.systems.mls.patterns import Trial, patterns_of
from boresight.systems.mls.runs import AZIMUTHS


@pytest.fixture(scope="module")
def found() -> dict[str, Trial]:
    return patterns_of(Array(), 3.0, 40, 7)


def test_names(found: dict[str, Trial]) -> None:
    names = [f"{v}_0{b}_{k}" for v in "xyz" for b in (1, 5) for k in AZIMUTHS]
    assert [*found] == [*names, "z_05_0_at_20", "z_05_0_at_30"]
    assert all(f"``{figure}``" in (Trial.__doc__ or "") for figure in found["x_01_0"].figures)


def test_gain_is_the_closed_form(found: dict[str, Trial]) -> None:
    for name, one in found.items():
        gain, closed = one.figures["gain"], one.figures["closed"]
        floor = 0.07 if closed < 0.6 else 0.03  # of an amplitude, which noise makes larger
        assert closed - 0.03 < gain < closed + floor, name
        assert one.shown.max() <= 1.0 and len(one.shown) == 2481


def test_figures_3_to_5(found: dict[str, Trial]) -> None:
    assert found["x_05_0"].figures["wrong"] > 0.1 and found["x_05_60"].figures["wrong"] == 0.0
    assert found["y_05_0"].figures["sd"] < 1e-9 and found["y_05_0"].figures[
        "gain"
    ] == pytest.approx(1.0, abs=1e-6)
    assert found["x_01_0"].figures["width"] == pytest.approx(1.59, abs=0.02)
    assert found["x_01_m60"].figures["width"] == pytest.approx(3.18, abs=0.04)
    assert found["x_01_0"].figures["sd"] < 0.08
    low, high = found["z_05_0"].figures["sidelobe_db"], found["z_05_0_at_30"].figures["sidelobe_db"]
    assert low == pytest.approx(-17.5, abs=0.4) and high > -13.5


def test_seeds_and_draws() -> None:
    """The same seed gives the same; another one does not."""
    a, b, c = (patterns_of(Array(8), 3.0, 3, seed)["x_05_0"] for seed in (1, 1, 2))
    assert a.figures == b.figures and a.figures["gain"] != c.figures["gain"]
