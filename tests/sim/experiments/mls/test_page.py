"""The page: every case, every verdict, plots, nothing from outside."""

import numpy as np
import pytest

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.mls.experiment import CASES
from boresight.sim.experiments.mls.flights import Beams, Flight
from boresight.sim.experiments.mls.page import render
from boresight.sim.experiments.mls.patterns import AZIMUTHS, Trial
from boresight.sim.worlds.mls_deck import deck


@pytest.fixture(scope="module")
def page() -> str:
    what = deck("table", 4.0, 1)
    flight = Flight([what], np.full((4000, 1, 3), 0.1), what.q[:, None], np.ones(1), (0.0, 0.0), 0)
    one = Trial(0.9531, 0.95, 0.96, 1.59, 0.036, 0.0, -17.8, np.full(2481, 0.5))
    names = [f"{v}_0{b}_{k}" for v in "xyz" for b in (1, 5) for k in AZIMUTHS]
    scan = np.linspace(-62.0, 62.0, 50)
    beams = {k: Beams(np.zeros(1), np.zeros(1), 2 * ((scan, 0.0 * scan),)) for k in AZIMUTHS}
    targets = [
        Target(name="claim one", source="fig 3", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="claim <two>", source="fig 4", value=0.5, low=2.0),
        Target(name="three", source="fig 5", value=0.5, low=2.0, binding=False, note="because"),
    ]
    found = {
        name: {"roll_deg": 0.0123, **({"beam_0_deg": 0.5} if k else {})}
        for k, name in enumerate(CASES)
    }
    patterns = {n: dict.fromkeys(names, one) for n in (64, 16)}
    return render(CASES, found, {n: flight for n in CASES}, beams, patterns, targets)


def test_everything_is_on_the_page(page: str) -> None:
    text = page
    for case in CASES.values():
        assert case.meaning.split(",")[0].replace("'", "&#39;") in text
    assert text.count('class="ok"') == 1 and text.count('class="bad"') == 2
    assert "FAIL" in text and "not true" in text and "because" in text
    assert "claim &lt;two&gt;" in text and "&ge; 2" in text and "&le; 1" in text
    assert text.count("<svg") == 5 == text.count("<figcaption>")
    assert text.count("0.953") == 36 and "beam 0 deg" in text


def test_nothing_from_outside(page: str) -> None:
    assert "http" not in page and "<script" not in page
