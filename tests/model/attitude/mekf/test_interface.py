"""What the `Mekf` shows of itself: names, the packed covariance, status bits."""

from boresight.model.attitude.mekf.interface import (
    AXES,
    PAIRS,
    PARAMS,
    START,
    STATES,
    covariance_name,
)


def test_half_a_covariance_is_all_of_it() -> None:
    """Each pair of the six error states once, the lower number first, each a state of its own."""
    assert sorted(PAIRS) == [(i, j) for i in range(6) for j in range(6) if i <= j]
    names = [covariance_name(i, j) for i, j in PAIRS]
    assert names[:2] == ["p_ee", "p_en"] and names[-1] == "p_zz"
    states = {s.name: s for s in STATES}
    assert set(names) == {name for name in states if name.startswith("p_")}
    assert len(states) == len(STATES) and AXES == ("e", "n", "u", "x", "y", "z")


def test_it_starts_without_an_attitude() -> None:
    results = {s.name: s.initial for s in STATES}
    assert [results[f"q{a}"] for a in "wxyz"] == [value for _, value in START]
    assert results["rest_s"] == results["horizontal"] == -1.0  # tilt and heading not known


def test_every_parameter_says_what_it_does() -> None:
    assert all(p.meaning and p.unit for p in PARAMS)
    assert len({p.name for p in PARAMS}) == len(PARAMS)
