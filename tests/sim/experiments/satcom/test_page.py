"""The page: every case, every verdict, plots, nothing from outside."""

import numpy as np

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.satcom.experiment import CASES
from boresight.sim.experiments.satcom.page import render


def page() -> str:
    found = {name: {"roll_deg": 0.0123, "loss_db_99": k} for k, name in enumerate(CASES)}
    calm, wild = np.full((4000, 3), 0.5), np.full((4000, 3), 80.0)
    shown = {n: (wild if n == "fixed_r" else calm, np.full(4000, 0.25)) for n in CASES}
    targets = [
        Target(name="claim one", source="step 1", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="claim <two>", source="step 2", value=0.5, low=2.0),
    ]
    return render(CASES, found, shown, targets)


def test_everything_is_on_the_page() -> None:
    text = page()
    for case in CASES.values():
        assert case.meaning.split(",")[0] in text
    assert text.count('class="ok"') == 1 == text.count('class="bad"')
    assert "claim &lt;two&gt;" in text and "&ge; 2.0" in text and "&le; 1.0" in text
    assert "0.0123" in text and "roll deg" in text and "<td>0.3<td" in text
    assert text.count("<svg") == 4 == text.count("<figcaption>")


def test_nothing_from_outside() -> None:
    assert "http" not in page() and "<script" not in page()
    assert page() == page()
