"""Advice that is followed without understanding: bad estimators become good in a few rounds.

Each round runs `check`, and does what its line says: double the range that is named, narrow one,
`fit`, a wider word. Nothing else is known of the estimator.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from boresight.cli import main

ROUNDS = 3
N = 400
_K = np.arange(N)
_NOISE = np.random.default_rng(3).normal(0.0, 1.0, N)

FILE = """\
from boresight import Estimator, Input, Output, State, ops

class Bad(Estimator):
    DECLARED

    def step(self, x, u, p):
        STEP
"""


class Row(NamedTuple):
    """An estimator with a fault, its log, the rounds that it takes (None: stays bad), its word."""

    declared: str
    step: str
    log: dict[str, np.ndarray]
    rounds: int | None
    word: int = 32


ROWS = {
    "a state a million times too wide": Row(
        'inputs = (Input("u", -8.0, 8.0, "V"),); states = (State("y", -1e7, 1e7, "V"),)\n'
        '    outputs = (Output("y", "V", tolerance=1e-3),)',
        "y = x.y + 0.01 * (u.u - x.y); return {'y': y}, {'y': y}",
        {"u": np.sin(0.05 * _K)},
        1,
        24,
    ),
    "a state too narrow": Row(
        'inputs = (Input("u", -10.0, 10.0, "N"),); states = (State("v", -0.6, 0.6, "m/s"),)\n'
        '    outputs = (Output("v", "m/s", tolerance=1e-3),)',
        "v = 0.99 * x.v + 0.01 * u.u; return {'v': v}, {'v': v}",
        {"u": 4.0 + 0.1 * _NOISE},
        3,
    ),
    "a claim that does not hold": Row(
        'inputs = (Input("a", -2.0, 2.0), Input("b", -2.0, 2.0))\n'
        '    outputs = (Output("c", tolerance=1e-3),)',
        "c = ops.bounded(u.a * u.b, -1.0, 1.0, 'both are small'); return {}, {'c': 0.5 * c}",
        {"a": 2.0 * np.sin(0.1 * _K), "b": 1.0 + _K / N},
        2,
    ),
    "a slow mean in a narrow word": Row(
        'inputs = (Input("u", -100.0, 100.0, "V"),); states = (State("m", -100.0, 100.0, "V"),)\n'
        '    outputs = (Output("m", "V", tolerance=1e-3),)',
        "m = x.m + 1e-3 * (u.u - x.m); return {'m': m}, {'m': m}",
        {"u": 40.0 * np.sin(0.002 * _K)},
        2,
        18,
    ),
    # Its author has to say what counts as no gradient at all: with ops.maximum, from physics.
    "a gradient that vanishes": Row(
        'inputs = (Input("gx", -1.0, 1.0), Input("gy", -1.0, 1.0))\n'
        '    outputs = (Output("nx", tolerance=1e-3),)',
        "n = ops.rsqrt(u.gx * u.gx + u.gy * u.gy)\n"
        "        return {}, {'nx': ops.bounded(u.gx * n, -1.0, 1.0, 'unit vector')}",
        {"gx": 0.5 * 0.97**_K, "gy": -0.3 * 0.97**_K},
        None,
    ),
    "a covariance by matrices, three measurements in an update": Row(
        'inputs = tuple(Input(n, -100.0, 100.0, "m") for n in "abc")\n'
        '    states = (State("x", -128.0, 128.0, "m"), State("v", -64.0, 64.0, "m/s"),\n'
        '        State("p00", 0.0, 16.0, initial=4.0), State("p01", -8.0, 8.0),\n'
        '        State("p11", 0.0, 4.0, initial=1.0))\n'
        '    outputs = (Output("x", "m", tolerance=1e-4), Output("v", "m/s", tolerance=3e-5))',
        "import numpy as np\n"
        "        F, m = np.array([[1.0, 0.02], [0.0, 1.0]]), np.array([x.x, x.v])\n"
        "        P = np.array([[x.p00, x.p01], [x.p01, x.p11]])\n"
        "        m, P = F @ m, F @ P @ F.T + np.diag([1e-4, 1e-3])\n"
        "        for z, h, r in ((u.a, 0, 0.01), (u.b, 1, 0.01), (u.c, 0, 0.04)):\n"
        "            K = P[:, h] / ops.clip(P[h, h] + r, r, 17.0)\n"
        "            K = [ops.bounded(k, -g, g, 'gain') for k, g in zip(K, (20.0, 10.0))]\n"
        "            m, P = m + np.array(K) * (z - m[h]), P - np.outer(K, P[h])\n"
        "        after = {'x': m[0], 'v': m[1]}\n"
        "        return after | {'p00': P[0, 0], 'p01': P[0, 1], 'p11': P[1, 1]}, after",
        {
            "a": 20.0 * np.sin(0.02 * _K) + 0.1 * _NOISE,
            "b": 20.0 * np.cos(0.02 * _K) + 0.1 * _NOISE[::-1],
            "c": 20.0 * np.sin(0.02 * _K) + 0.2 * np.roll(_NOISE, 7),
        },
        1,
    ),
}


class Follower:
    """An estimator's file, which changes as `check` advises."""

    def __init__(self, row: Row, capsys: pytest.CaptureFixture[str]) -> None:
        self.file, self.profile, self.word = Path("bad.py"), Path("bad.fit.json"), row.word
        self.capsys, self.trail, self.fitted = capsys, list[str](), False
        text = FILE.replace("DECLARED", row.declared).replace("STEP", row.step)
        self.file.write_text(text)
        table = np.column_stack(list(row.log.values())).tolist()
        lines = [",".join(row.log), *(",".join(map(repr, values)) for values in table)]
        Path("log.csv").write_text("\n".join(lines) + "\n")

    def run(self, verb: str, *options: str) -> tuple[int, str]:
        """Exit code of a verb, and what it prints."""
        code = main([verb, "bad.py", "log.csv", "--word", str(self.word), *options, "-q"])
        printed = self.capsys.readouterr()
        return code, printed.out + printed.err

    def rounds(self) -> int | None:
        """Rounds until `check` passes; None if it does not, or says nothing that can be done."""
        for k in range(ROUNDS + 1):
            code, text = self.run("check", "--levels", "fixed")
            if code == 0:
                return k
            advice = [
                x
                for x in text.splitlines()
                if re.search("first wrong: |error: |BEYOND the stated range", x)
            ]
            self.trail += advice
            if not advice or not self.follow(advice[0]):
                break
        return None

    def follow(self, advice: str) -> bool:
        """Do what a line says; False if nothing of it can be done."""
        beyond = re.search(r"(\S+) does not fit its range \[(\S+), (\S+)\]; widen the", advice)
        if beyond:
            return self.widen(advice, *map(float, beyond.groups()))
        broken = re.search(r"(\S+) in step \d+ is BEYOND the stated range \[(\S+), (\S+)\]", advice)
        if broken:
            return self.widen(advice, *map(float, broken.groups()))
        if "boresight fit" in advice and not self.fitted:
            self.fitted = True
            return self.run("fit")[0] == 0
        if "narrow" in advice and self.narrow():
            return True
        if "wider word" in advice and self.word < 32:
            self.word = min(self.word + 8, 32)
            return True
        return False

    def narrow(self) -> bool:
        """Replace the ranges of inputs and states that `fit` names, and fit again."""
        before = text = self.file.read_text()
        named = r"(?:state|input) (\w+) .*?narrow its range to \[(\S+), (\S+)\]"
        for name, low, high in re.findall(named, self.run("fit")[1]):
            declared = rf'((?:Input|State)\("{name}"), [^,]+, [^,)]+'
            text = re.sub(declared, rf"\g<1>, {low}, {high}", text)
        self.file.write_text(text)
        self.profile.unlink(missing_ok=True)
        return text != before and self.run("fit")[0] == 0

    def widen(self, advice: str, reached: float, low: float, high: float) -> bool:
        """Double the range that a line names, or more where the value is beyond that."""
        factor = max(2.0, abs(reached) / max(-low, high))
        state, place = re.search(r"state (\w+)", advice), re.search(r"py, line (\d+)", advice)
        lines = self.file.read_text().splitlines(keepends=True)
        for k, line in enumerate(lines):
            named = f'"{state[1]}"' in line if state else bool(place) and str(k + 1) == place[1]
            wider = line.replace(f"{low}, {high}", f"{factor * low}, {factor * high}")
            if named and wider != line:
                self.file.write_text("".join([*lines[:k], wider, *lines[k + 1 :]]))
                self.profile.unlink(missing_ok=True)
                self.fitted = False
                return True
        return False


@pytest.mark.parametrize("name", ROWS)
def test_advice_followed(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    follower = Follower(ROWS[name], capsys)
    rounds = follower.rounds()
    assert rounds == ROWS[name].rounds and rounds != 0, "\n".join(follower.trail)
