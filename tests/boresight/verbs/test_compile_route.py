"""`boresight compile --target ... --route` and its depth, by the command line."""

import json

import pytest

from boresight.cli import main
from boresight.gateware.synthesis.nextpnr import find_program
from boresight.model.tools.folders import cache_folder
from tests.support.router import REPORT, is_installed, stand_in

#: One multiplier is enough for words of 18 bits.
GAIN = """
from boresight import Estimator, Input, Output, Param

class Gain(Estimator):
    inputs = (Input("x", -1.0, 1.0, "1"),)
    params = (Param("k", 0.5, 0.0, 1.0, "1", "gain"),)
    outputs = (Output("y", "1", tolerance=0.01),)

    def step(self, x, u, p):
        return {}, {"y": p.k * u.x}
"""
WRITES = f"pathlib.Path('report.json').write_text({json.dumps(REPORT)!r})"


@pytest.fixture
def small(tmp_path):
    (tmp_path / "gain.py").write_text(GAIN)
    file = str(tmp_path / "gain.py")
    return ["compile", file, "--word", "18", "--target", "ecp5-25k", "-q", "-o"]


@pytest.fixture
def router(tmp_path, monkeypatch):
    """A stand-in, whose results are in no user's cache."""
    monkeypatch.setenv("YOWASP_CACHE_DIR", str(cache_folder("YoWASP")))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield stand_in(tmp_path, monkeypatch)
    find_program.cache_clear()


def test_the_slowest_seed_is_held_against_the_clock(router, small, tmp_path, capsys):
    arguments = router(WRITES)
    for clock, code in (("60", 0), ("70", 1)):
        out = tmp_path / clock
        route = ["--route", "--seeds", "2", "--clock", clock, "--depth", "7"]
        assert main([*small, str(out), *route]) == code
        assert f"--seed 2 --freq {clock}" in " ".join(arguments())
        text = capsys.readouterr().out
        assert "clock 66.6 MHz (routed on ecp5-25k, speed 6, nextpnr-ecp5 9.8" in text
        assert ("; BELOW 70 MHz" in text) == (code == 1)
        timing = json.loads((out / "report.json").read_text())["timing"]
        assert timing["fmax_mhz"] == {"-6": {"routed": 66.6}}
        assert timing["seeds"] == {"1": 66.69, "2": 66.69}


def test_nothing_is_left_of_a_core_that_cannot_be_routed(router, small, tmp_path, capsys):
    router("print('ERROR: Unable to place cell', file=sys.stderr); sys.exit(1)")
    out = tmp_path / "out"
    assert main([*small, str(out), "--route", "--depth", "7"]) == 2
    error = capsys.readouterr().err
    assert "ecp5-25k: ERROR: Unable to place cell (log: " in error and error.count("\n") == 1
    assert not out.exists()


def test_a_small_core_is_routed(small, tmp_path, capsys):
    """By nextpnr itself; without it, the line that installs it is the answer."""
    code = main([*small, str(tmp_path / "out"), "--route"])
    shown = capsys.readouterr()
    if not is_installed("nextpnr-ecp5"):
        assert code == 1 and "pip install boresight[ecp5]" in shown.err
        return
    assert code == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert 60 < report["timing"]["fmax_mhz"]["-6"]["routed"] < 400
    assert report["resources"]["dsp"] and f"({report['config']}): " in shown.out


def test_depth_by_time_and_by_hand(small, tmp_path, capsys):
    """The least of the times is chosen; depth 7 gives the core of a target without clocks."""
    reports = {}
    for name, more in {"time": [], "7": ["--depth", "7"], "none": ["--target", "generic"]}.items():
        assert main([*small, str(tmp_path / name), *more]) == 0
        reports[name] = json.loads((tmp_path / name / "report.json").read_text())
    text = capsys.readouterr().out
    us = reports["time"]["depth"]["us"]
    best = min(us, key=us.get)
    assert set(us) == {"7", "9", "10", "12"} and us[best] < us["7"]
    assert reports["time"]["config"] == f"small-d{best}" and f"depth {best} for ecp5-25k" in text
    assert "depth" not in reports["7"] | reports["none"] and reports["7"]["config"] == "small"
    assert (
        len({(tmp_path / n / "core.v").read_text().partition("*/")[2] for n in ("7", "none")}) == 1
    )
