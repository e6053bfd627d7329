"""The monitor's picture: three angles, broken where they wrap and where frames are missing."""

from __future__ import annotations

import re

import pytest

from boresight.gateware.attitude.system.attitude_frame import Attitude
from boresight.sim.attitude.host.plot import plot_image
from boresight.sim.plotting import COLOUR

NAMES = ("heading", "pitch", "roll")


def image(
    headings: list[float], gaps: list[tuple[int, int]], form: str = "svg", *, timed: bool = True
) -> bytes:
    track = [
        Attitude(number=k, heading=h, pitch=5.0 * k, roll=-k, flags=0, status=0, stamp=k)
        for k, h in enumerate(headings)
    ]
    return plot_image([float(k * k) for k in range(len(track))], track, gaps, form, timed=timed)


def pieces(svg: bytes, name: str) -> list[int]:
    """Points of each piece of an angle's line."""
    matches = re.findall(
        rf'<path d="([^"]*)"[^>]*style="fill: none; stroke: {COLOUR[name].lower()}', svg.decode()
    )
    (path,) = (d for d in matches if "M" in d)
    return [piece.count("L") + 1 for piece in path.split("M")[1:]]


def test_one_line_for_each_angle() -> None:
    svg = image([10.0, 50.0, 30.0, 60.0], [])
    assert {name: pieces(svg, name) for name in NAMES} == {name: [4] for name in NAMES}
    for label in (*(f"{name} [deg]" for name in NAMES), "4 attitudes", "time since the first [s]"):
        assert label.encode() in svg
    assert b"missing" not in svg


def test_a_wrap_breaks_the_heading_alone() -> None:
    svg = image([179.0, -1.0, 179.5, -179.5, -100.0, 80.5], [])
    assert pieces(svg, "heading") == [2, 1, 2, 1]
    assert pieces(svg, "pitch") == [6]


def test_missing_frames_break_every_line_and_are_counted() -> None:
    svg = image([10.0, 50.0, 30.0, 60.0, 20.0], [(0, 3), (2, 4)], timed=False)
    for name in NAMES:
        assert pieces(svg, name) == [1, 2, 2]
    assert b"5 attitudes, 7 missing (grey)" in svg and b"number of the update" in svg
    grey = re.findall(rf"fill: {COLOUR['grey']}; opacity: 0.35", svg.decode())
    assert len(grey) == 2 * len(NAMES)


@pytest.mark.parametrize(("form", "magic"), [("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_formats(form: str, magic: bytes) -> None:
    assert image([1.0], [], form).startswith(magic)
