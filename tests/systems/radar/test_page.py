"""The page: every bias, every verdict, four plots, nothing from outside."""

from boresight.systems.radar.interface import BIASES
from boresight.systems.radar.page import render
from tests.support.radar_figures import found, spread, targets, theory, watched


def test_everything_is_on_the_page() -> None:
    data = found(registration_range_1_percent=3.0)
    goals = targets(registration_range_1_percent=3.0)
    text = render(watched(1.0), watched(10.0), theory(), spread(), data, goals)
    for b in BIASES:
        assert b.replace("_", " radar ") in text
    assert text.count("<svg") == 4 == text.count("<figcaption>")
    assert text.count(">FAIL</span>") == 7 and text.count(">FAIL</span> (reported)") == 6
    assert text.count("no estimator can") == 6
    assert "http" not in text and "<script" not in text
    again = render(watched(1.0), watched(10.0), theory(), spread(), data, goals)
    assert text == again
