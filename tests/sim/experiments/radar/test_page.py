"""The page: every bias, every verdict, four plots, nothing from outside."""

from boresight.model.estimators.radar.interface import BIASES
from boresight.sim.experiments.radar.experiment import targets
from boresight.sim.experiments.radar.page import render
from tests.support.radar_figures import found, spread, theory, watched


def test_everything_is_on_the_page() -> None:
    data = found(registration_range_1_percent=3.0)
    text = render(watched(1.0), watched(10.0), theory(), spread(), data, targets(data))
    for b in BIASES:
        assert b.replace("_", " radar ") in text
    assert text.count("<svg") == 4 == text.count("<figcaption>")
    assert text.count(">\nFAIL") == 1 and text.count("impossible") == 6
    assert "http" not in text and "<script" not in text
    again = render(watched(1.0), watched(10.0), theory(), spread(), data, targets(data))
    assert text == again
