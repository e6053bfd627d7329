"""Figures of draws whose answer is known; quantiles against scipy."""

import numpy as np
import pytest
from scipy.stats import chi2 as exact

from boresight.sim.montecarlo.figures import chi2, figures, text


def made(n: int, seed: int, *, sd: float = 2.0, mean: float = 0.0, believed: float = 2.0):
    """Draws of a Gaussian error of one output at two marks, and what the filter believes."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(n):
        e = mean + sd * rng.normal(size=2)
        out.append(
            {
                "seed": k,
                "marks": [0, 9],
                "errors": {"a": e.tolist()},
                "nees": ((e / believed) ** 2).tolist(),
                "freedom": 1,
                "nis": [float((rng.normal(size=(20, 3)) ** 2).sum()), 20],
                "saturated": 1,
            }
        )
    return out


@pytest.mark.parametrize("freedom", [10, 99, 1500])
def test_quantiles(freedom: int) -> None:
    for p in (0.025, 0.5, 0.975):
        z = {0.025: -1.959964, 0.5: 0.0, 0.975: 1.959964}[p]
        assert chi2(freedom, z) == pytest.approx(exact.ppf(p, freedom), rel=1e-2)


def test_an_honest_filter_lies_in_its_bands() -> None:
    found = figures(made(400, 1), {"a": np.full(10, 2.0)}, 3)
    one = found["outputs"]["a"]
    assert abs(one["mean"][1]) < one["mean_band"][1] == pytest.approx(1.96 * 2.0 / 20.0, rel=0.1)
    assert one["sd_band"][0][1] < 2.0 < one["sd_band"][1][1]
    assert one["ratio"][1] == pytest.approx(1.0, abs=0.08) and one["bound"] == [2.0, 2.0]
    for key, mean in (("nees", found["nees"]["mean"][1]), ("nis", found["nis"]["mean"])):
        low, high = found[key]["band"]
        assert low < mean < high
    assert found["saturated"] == 400 == found["runs"]


def test_one_that_believes_too_much_or_is_biased_does_not() -> None:
    sure = figures(made(400, 1, believed=1.8), {}, 3)
    assert sure["nees"]["mean"][1] > sure["nees"]["band"][1]
    off = figures(made(400, 1, mean=0.5), {}, 0)["outputs"]["a"]
    assert off["mean"][1] > off["mean_band"][1] and "bound" not in off
    assert off["rms"][1] == pytest.approx(np.hypot(off["sd"][1], off["mean"][1]), rel=1e-2)


def test_bounds_that_are_none() -> None:
    least = np.array([np.inf, *9 * [0.0]])
    one = figures(made(20, 1), {"a": least}, 0)["outputs"]["a"]
    assert one["bound"] == [None, None] == one["ratio"]


def test_table() -> None:
    data = figures(made(50, 1), {"a": np.full(10, 2.0)}, 3)
    lines = text(data, {"a": "m"}).splitlines()
    assert lines[1].startswith("a ") and lines[1].endswith(" m") and lines[1].split()[4] == "2"
    assert lines[2].startswith("NEES per degree") and lines[3].startswith("NIS per degree")
    assert lines[-1] == "50 draws, saturated updates: 50"
