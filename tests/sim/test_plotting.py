"""Inline SVG: the same text for the same data, nothing from outside, no mark of the tool."""

from boresight.sim.plotting import COLOUR, INK, figure_and_axes, settings, svg


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
