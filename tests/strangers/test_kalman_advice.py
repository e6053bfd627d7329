"""Advice of `check` on a Kalman filter, followed to the letter, makes it good in one round."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boresight
from boresight import InputError

EXAMPLES = Path(boresight.__file__).parents[1] / "examples"
#: Position and velocity of a ship by bearings from another one, 3 km away; as first written.
TRACKER = """
import numpy as np
from boresight import Input, Output
from boresight.kalman import Kalman, Measurement, State

class Tracker(Kalman):
    inputs = (
        Input("ox", -3000.0, 3000.0, "m"), Input("oy", -3000.0, 3000.0, "m"),
        Input("bearing", -3.2, 3.2, "rad"),
    )
    states = (
        State("x", -4000.0, 4000.0, "m", initial=1500.0, sd=300.0, sd_max=4800.0),
        State("y", -4000.0, 4000.0, "m", initial=1500.0, sd=300.0, sd_max=4800.0),
        State("vx", -15.9, 15.9, "m/s", sd=4.0),
        State("vy", -15.9, 15.9, "m/s", sd=4.0),
    )
    outputs = (Output("x", "m", tolerance=0.05), Output("y", "m", tolerance=0.05))

    def f(self, x, u, p):
        return {"x": x.x + x.vx, "y": x.y + x.vy}

    def noise(self, x, u, p):
        return {"vx": 1e-3, "vy": 1e-3}

    def measure(self, x, u, p):
        h = np.arctan2(x.y - u.oy, x.x - u.ox)
        return [Measurement(u.bearing, h, 1e-4)]
"""


def bearings() -> dict[str, np.ndarray]:
    """Columns of a log of 200 s: the observer turns every minute."""
    t = np.arange(200.0)
    heading = np.where((t // 60) % 2 == 0, 0.3, 2.2)
    ox = -1000.0 + np.cumsum(8.0 * np.cos(heading))
    oy = -2000.0 + np.cumsum(8.0 * np.sin(heading))
    noise = np.random.default_rng(3).normal(0.0, 0.01, len(t))
    bearing = np.arctan2(1300.0 + 1.5 * t - oy, 1800.0 - 3.0 * t - ox) + noise
    return {"t": t, "ox": ox, "oy": oy, "bearing": bearing}


def put(text: str, line: int, argument: str) -> str:
    """A file whose call on a line has this argument, ``name=value``."""
    lines, name = text.splitlines(), argument.partition("=")[0]
    said = rf"\b{name}=(\{{.*?\}}|[-\w.*]+)"
    old = lines[line - 1]
    new = (
        re.sub(said, argument, old)
        if re.search(said, old)
        else old.replace(")]", f", {argument})]")
    )
    assert argument in new, (old, argument)
    lines[line - 1] = new
    return "\n".join(lines) + "\n"


def advised(said: str) -> list[tuple[int, str]]:
    """Lines and arguments that a message asks for."""
    value = r"((?:sd_max|slope_max)=(?:\{.*?\}|[-\w.]+\b))"
    found = re.findall(rf"line (\d+), measurement: wanted a derivative by .* {value}$", said)
    found += re.findall(rf"line (\d+)\) wastes \d+ bits?: {value} suffices", said)
    raised = re.findall(r"line (\d+)[^;\n]*; raise sd_max(?: of this Measurement)? to (\S+)", said)
    return [(int(line), x) for line, x in found] + [(int(k), f"sd_max={x}") for k, x in raised]


def follow(
    text: str, tmp_path: Path, source: Any, word: int, most: int = 3
) -> tuple[list[Any], str]:
    """Results round by round, until `check` is good or rounds are over; and the last file."""
    rounds: list[Any] = []
    for n in range(most):
        path = tmp_path / f"round_{n}.py"
        path.write_text(text)
        try:
            (result,) = boresight.check(str(path), source, levels=("fixed",), word=word)["results"]
        except InputError as error:
            said = str(error)
        else:
            rounds.append(result)
            if result.good:
                break
            said = "\n".join(result.lines())
        for line, argument in advised(said):
            text = put(text, line, argument)
    return rounds, text


def test_a_tracker_by_bearings_is_good_after_one_round(tmp_path: Path) -> None:
    rounds, text = follow(TRACKER, tmp_path, bearings(), 27)
    first, last = (r.accuracy.differences[1].largest for r in (rounds[0], rounds[-1]))
    assert len(rounds) == 2 and first > 20.0 * last and rounds[-1].good, text
    assert (
        'slope_max={"x": 2**-12, "y": 2**-13}, sd_max=0.084' in text
        and text.count("sd_max=360") == 2
    )


def test_a_derivative_beyond_slope_max_is_told(tmp_path: Path) -> None:
    text = TRACKER.replace("1e-4)]", '1e-4, slope_max={"x": 2**-15, "y": 2**-12})]')
    (result,), _ = follow(text, tmp_path, bearings(), 32, most=1)
    (said,) = [w for w in result.given.warnings if "slope_max" in w]
    assert "the derivative by x is limited" in said and said.endswith("of x by 2**3"), said


@pytest.mark.parametrize(("world", "times"), [("Bearing", 16.0), ("Pendulum", 1.0 / 1.2)])
def test_an_example_with_a_wrong_sd_max_recovers(world: str, times: float, tmp_path: Path) -> None:
    text = (EXAMPLES / f"{world.lower()}.py").read_text()
    text = re.sub(
        r"\bsd=([\d.]+)(, sd_max=[\d.]+)?\)",
        lambda sd: f"sd={sd[1]}, sd_max={1.2 * times * float(sd[1]):g})",
        text,
    )
    rounds, _ = follow(text, tmp_path, f"{EXAMPLES / 'worlds.py'}:{world}", 26)
    assert rounds[-1].good and len(rounds) <= 2


@pytest.mark.parametrize("stated", [0.003, 0.8])
def test_a_wrong_sd_max_of_a_measurement_is_told_with_what_suffices(stated, tmp_path) -> None:
    text = (EXAMPLES / "bearing.py").read_text().replace("sd_max=0.05", f"sd_max={stated}")
    rounds, text = follow(text, tmp_path, f"{EXAMPLES / 'worlds.py'}:Bearing", 26)
    assert [r.good for r in rounds] == [False, True] and "sd_max=0.049)" in text
