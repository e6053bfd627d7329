"""`boresight check` names what is wrong: the value, its line, and a cure."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from boresight.cli import main

pytestmark = pytest.mark.pythons

BAD = Path(__file__).with_name("bad.py")
N = 900
_K = np.arange(N)
_NOISE = np.random.default_rng(11).normal(0.0, 1.0, N)

#: Record of each, and what its line says.
CASES = {
    "FlatGradient": (
        {"gx": 0.5 * 0.97**_K, "gy": -0.3 * 0.97**_K},
        "significant bits; scale the argument",
    ),
    "Integrator": (
        {"rate": 9.0 + 0.1 * _NOISE},
        "state angle (bad.py, line 34): 45.1948 does not fit its range [-45, 45]",
    ),
    "NarrowState": ({"force": 6.0 + 0.1 * _NOISE}, "does not fit its range [-2, 2]"),
    "Hope": (
        {"a": 2.0 * np.sin(0.1 * _K), "b": 1.0 + _K / N},
        "does not fit its range [-1, 1]; widen the range (declared: both are small)",
    ),
    "NegativeRoot": ({"c": 3.0 + 0.0 * _K, "a": 2.9 + 1e-3 * _K}, "rsqrt: argument -"),
    "WideSine": ({"s": _K / N}, "is outside 0 to 0.7188"),
    "SmallDivisor": (
        {"range": 100.0 - 0.1 * _K, "speed": 80.0 * 0.985**_K},
        "does not fit its range [0, 50]; widen the range (declared: near enough)",
    ),
    "CoarseFilter": (
        {"x": 40.0 * np.sin(0.002 * _K)},
        "rounding adds up; of the error of mean 100% from state mean (bad.py, line ",
    ),
    "Vanishing": (
        {"rate": 0.5 + 0.1 * np.sin(_K), "gain": 0.5 + 0.0 * _K},
        "rounding adds up; state count (bad.py, line ",
    ),
    "Windup": ({"error": 12.0 + _NOISE}, "does not fit its range [-50, 50]"),
    "LongVector": (
        {"x": 0.4 + 0.3 * np.sin(_K), "y": 0.4 + 0.3 * np.cos(_K)},
        "below the floor 2^-22",
    ),
    "Runaway": ({"x": np.ones(N)}, "does not fit its range [-8, 8]"),
}


def _lines(name: str) -> set[int]:
    """Lines of a class that carry its fault."""
    text = BAD.read_text().splitlines()
    first = next(k for k, line in enumerate(text) if line.startswith(f"class {name}("))
    out = set()
    for k in range(first, len(text)):
        if k > first and text[k].startswith("class "):
            break
        out |= {k + 1} if "# FAULT" in text[k] else set()
    return out


def _log(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = np.column_stack(list(columns.values())).tolist()
    body = "".join(",".join(map(repr, row)) + "\n" for row in rows)
    path.write_text(",".join(columns) + "\n" + body)
    return path


@pytest.mark.parametrize("name", list(CASES))
def test_the_culprit_is_named(name: str, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    columns, said = CASES[name]
    log = _log(tmp_path / "log.csv", columns)
    word = ["--word", "18"] if name in ("CoarseFilter",) else []
    line = ["check", f"{BAD}:{name}", str(log), "--levels", "fixed,c", *word]
    assert main(line) == 1
    text = capsys.readouterr().out
    (first,) = [x for x in text.splitlines() if "first wrong: " in x]
    assert said in first
    place = re.search(r"bad\.py, line (\d+)", first)
    assert place is not None and int(place.group(1)) in _lines(name), first
    assert text.splitlines()[-1].startswith("FAILED: ")
    assert main([*line, "--json"]) == 1
    (result,) = json.loads(capsys.readouterr().out)["results"]
    assert result["exact"] and not result["good"]  # all levels agree on what is wrong
    assert result["accuracy"]["culprit"] and result["accuracy"]["culprit"] in first


def test_a_state_beyond_its_range_fails_even_where_its_word_holds_it(tmp_path, capsys) -> None:
    log = _log(tmp_path / "log.csv", {"rate": np.full(600, 9.0)})
    assert main(["check", f"{BAD}:Integrator", str(log), "--levels", "fixed,c"]) == 1
    text = capsys.readouterr().out
    assert "state angle is 45.18 in step 501, BEYOND its declared range [-45, 45]" in text
    assert "first wrong: step 501, value state angle (bad.py, line 34): 45.18 does" in text


def test_a_state_within_its_range_is_not(tmp_path, capsys) -> None:
    log = _log(tmp_path / "log.csv", {"rate": np.full(500, 9.0)})
    assert main(["check", f"{BAD}:Integrator", str(log), "--levels", "fixed,c"]) == 0
    assert "BEYOND" not in capsys.readouterr().out
