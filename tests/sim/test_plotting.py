"""Inline SVG: the same text for the same data, nothing from outside, no mark of the tool."""

import numpy as np

from boresight.sim.plotting import COLOUR, INK, band, figure_and_axes, settings, svg


def drawn(salt: str = "one", **keywords) -> str:
    with settings():
        figure, axes = figure_and_axes(2.0, **keywords)
        for axis in getattr(axes, "flat", [axes]):
            axis.plot((0.0, 1.0), (1.0, 0.0), color=COLOUR["roll"], label="a & b")
        return svg(figure, salt)


def test_an_element_for_html() -> None:
    text = drawn()
    assert text == drawn()
    assert text.startswith('<svg class="plot" role="img" viewBox="0 0 748.8 144">')
    assert text.endswith("</svg>") and text.count("<svg") == 1
    for outside in ("xmlns", "xlink", "<metadata", "<?xml", "<!DOCTYPE", "http", "Matplotlib v"):
        assert outside not in text, outside
    assert "\n " not in text
    assert INK in text and COLOUR["roll"].lower() in text


def test_band_shows_least_and_most() -> None:
    """Of each part of the curve, in its middle; what is left at the end is not shown."""
    values = np.array([0.0, 3.0, 1.0, -1.0, 5.0, 4.0, 9.0])
    with settings():
        figure, axes = figure_and_axes(2.0)
        band(axes, values, 0.5, 2, color=COLOUR["roll"], label="curve")
        (shown,) = axes.collections
        corners = {(float(x), float(y)) for x, y in shown.get_paths()[0].vertices}
        assert corners == {(0.75, 0.0), (0.75, 3.0), (2.25, -1.0), (2.25, 5.0)}
        assert shown.get_label() == "curve" and "<svg" in svg(figure, "band")
        band(axes, values, 0.5, 100)
        assert len(axes.collections[1].get_paths()[0].vertices) == 2 * len(values) + 3
