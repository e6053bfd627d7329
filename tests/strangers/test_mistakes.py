"""Mistakes of strangers: one line with the place, what was found and a remedy; exit code 2.

``messages.txt`` has the line of each mistake; ``BORESIGHT_UPDATE=1`` writes it anew.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from boresight.cli import main

pytestmark = pytest.mark.pythons

MESSAGES = Path(__file__).with_name("messages.txt")

HEAD = """\
import math, random
import numpy as np
from boresight import Estimator, Input, Output, Param, State, World, ops

class Wrong(Estimator):
    inputs = (Input("a", -2.0, 2.0, "m"), Input("b", 0.0, 2.0, "m"))
    params = (Param("gain", 0.5, 0.0, 1.0),)
    states = (State("pos", -4.0, 4.0, "m"),)
    outputs = (Output("y", "m"),)

    def step(self, x, u, p):
"""
RETURN = 'return {"pos": 0.5 * x.pos}, {"y": y}'

#: What stands before RETURN.
INSIDE = {
    "float power": "y = u.b ** 0.5",
    "negative power": "y = u.a ** -2",
    "np.sinh": "y = np.sinh(u.a)",
    "math.sin": "y = math.sin(u.a)",
    "float()": "y = 2.0 * float(u.a)",
    "index": "y = [1.0, 2.0][u.b]",
    "if": "y = u.a\n        if u.a > 0.0:\n            y = u.b",
    "chained": "y = ops.where(0.0 < u.a < 1.0, 1.0, 0.0)",
    "max()": "y = max(u.a, u.b)",
    "==": "y = ops.where(u.a == 0.0, 1.0, 0.0)",
    "& without brackets": "y = ops.where(u.a > 0.0 & u.b, 1.0, 0.0)",
    "condition as a number": "y = u.a + (u.b > 1.0)",
    "whole quotient": "y = u.a // 2.0",
    "typo in an input": "y = u.aa",
    "random": "y = u.a * random.random()",
    "not a number": "y = u.a * math.nan",
    "None as operand": "y = u.a * None",
    "divisor 0": "y = u.a / 0.0",
    "divisor through 0": "y = 1.0 / u.a",
    "divisor without a name": "d = u.a - u.b\n        y = 1.0 / d",
    "asin below 0": "y = ops.asin_ht(0.2 * u.a)",
    "root of a negative": "y = ops.sqrt(u.b - u.a)",
    "exp too large": "y = ops.exp(400.0 * u.a)",
    "no finite range": "y = ops.rsqrt(u.b)",
    "beyond the word": 'y = ops.bounded(u.a * 2.0**300, -1.0, 1.0, "small")',
    "limits out of order": "y = ops.clip(u.a, 1.0, -1.0)",
    "bound of a value": "y = ops.bounded(u.a, 0.0, u.b, 'x')",
}
#: Other texts for RETURN.
RETURNED = {
    "returned: one dictionary": 'return {"y": y}',
    "returned: forgotten state": 'return {}, {"y": y}',
    "returned: unknown state": 'return {"pos": y, "vel": y}, {"y": y}',
    "returned: extra output": 'return {"pos": y}, {"y": y, "z": y}',
    "returned: condition": 'return {"pos": y}, {"y": y > 0.0}',
    "returned: array": 'return {"pos": y}, {"y": np.array([y, y])}',
    "returned: constant": 'return {"pos": 9.0}, {"y": y}',
}
#: What is replaced in a good file, by what.
DECLARED = {
    "declared: default": ("0.5, 0.0, 1.0),)", "5.0, 0.0, 1.0),)"),
    "declared: a text": ('Param("gain", 0.5,', 'Param("gain", "0.5",'),
    "declared: initial": ('4.0, "m"),)', '4.0, "m", 9.0),)'),
    "declared: backwards": ('"b", 0.0, 2.0, "m"))', '"b", 2.0, 0.0, "m"))'),
    "declared: infinite": ('"b", 0.0, 2.0, "m"))', '"b", 0.0, math.inf))'),
    "declared: no name": ('Input("b", 0.0, 2.0, "m"))', 'Input(0.0, 2.0, "m"))'),
    "declared: twice": ('Input("b", 0.0, 2.0, "m"))', 'Input("a", 0.0, 2.0))'),
    "declared: one, not a tuple": ('(Output("y", "m"),)', 'Output("y", "m")'),
    "declared: no outputs": ('(Output("y", "m"),)', "()"),
    "declared: rate of nothing": (
        "    states = (",
        '    rates_hz = {"dt": 9.0, "xx": 9.0}\n    states = (',
    ),
    "declared: flag of nothing": ('"b", 0.0, 2.0, "m"))', '"b", 0.0, 1.0, valid_of="z"))'),
    "declared: step without p": ("(self, x, u, p):", "(self, x, u):"),
    "declared: called as an input": (
        'Param("gain", 0.5, 0.0, 1.0),)',
        'Param("b", 0.5, 0.0, 1.0),)',
    ),
    "declared: no step": ("def step", "def steps"),
}
#: Command lines in a folder of FILES.
LINES = {
    "no file": "run nosuch.py log.csv",
    "two classes": "run two.py log.csv",
    "no such class": "run two.py:Other log.csv",
    "not a class": "run good.py:ops log.csv",
    "arguments": "run good.py:Wrong(n=f()) log.csv",
    "no log": "check good.py nosuch.csv",
    "no such column": "run good.py other.csv",
    "unknown unit": "run good.py unknown.csv",
    "unit of another kind": "run good.py dimension.csv",
    "empty cell": "run good.py gap.csv",
    "value beyond its range": "check good.py far.csv",
    "bad header": "run good.py bracket.csv",
    "not a table": "run good.py binary.csv",
    "world gives a list": "run good.py world_list.py",
    "world gives too little": "run good.py world_lacks.py",
    "world gives a text": "run good.py world_text.py",
    "world raises": "run good.py world_raises.py",
    "world gives nothing": "run good.py world_empty.py",
    "world without a record": "run good.py good.py",
    "level": "run good.py log.csv --levels tin",
    "word": "check good.py log.csv --word 64",
    "parameter": "check good.py log.csv --param gian=1",
    "parameter beyond its range": "check good.py log.csv --param gain=2",
    "tolerance": "check good.py log.csv --tolerance z=1",
    "tolerance with two points": "check good.py log.csv --tolerance y=1.5.5",
    "rows": "check good.py log.csv --from 9s",
    "profile": "check good.py log.csv --profile nosuch.json",
    "output is an input": "run good.py log.csv -o log.csv",
    "file of the user": "run good.py log.csv -o notes.csv",
}
RECORDS = {
    "list": "return [1.0]",
    "lacks": 'return {"a": 1.0}',
    "text": 'return {"a": "one", "b": 1.0}',
    "raises": 'return {"a": {}["gone"], "b": 1.0}',
    "empty": "return None",
}
WORLD = """
class Plant(World):
    def start(self):
        self.k = 0
    def record(self, outputs):
        self.k += 1
        RECORD
"""


def wrong(step: str = "y = u.a", returned: str = RETURN) -> str:
    """The file of an estimator."""
    return f"{HEAD}        {step}\n        {returned}\n"


FILES: dict[str, str | bytes] = {
    "good.py": wrong(),
    "two.py": wrong() + wrong().partition("ops\n")[2].replace("Wrong", "Second"),
    "log.csv": "t,a,b\n0,1,1\n1,1,1\n2,0,1\n",
    "other.csv": "t,z\n0,1\n1,2\n",
    "unknown.csv": "a[furlongs/fortnite],b\n1,1\n",
    "dimension.csv": "a[m/s],b\n1,1\n",
    "gap.csv": "a,b\n1,1\n,1\n",
    "far.csv": "t,a[km],b\n0,0.001,1\n1,0.03,1\n",
    "bracket.csv": "a[m,b\n1,1\n",
    "binary.csv": b"\x00\xff\xfe" * 9,
    "notes.csv": "mine\n",
    **{
        f"world_{name}.py": HEAD.partition("\nclass")[0] + WORLD.replace("RECORD", record)
        for name, record in RECORDS.items()
    },
}

#: The file wrong.py, if there is one, and the command line of each mistake.
MISTAKES: dict[str, tuple[str, str]] = {
    **{name: (wrong(step), "") for name, step in INSIDE.items()},
    **{name: (wrong("y = 0.5 * x.pos", text), "") for name, text in RETURNED.items()},
    **{name: (wrong().replace(*pair), "") for name, pair in DECLARED.items()},
    **{name: ("", line) for name, line in LINES.items()},
}


def golden() -> dict[str, str]:
    """The messages by the name of their mistake."""
    lines = MESSAGES.read_text(encoding="utf-8").splitlines()
    return dict(zip(lines[::2], (line.strip() for line in lines[1::2]), strict=True))


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text, line = MISTAKES[name]
    for file, content in FILES.items():
        Path(file).write_bytes(content if isinstance(content, bytes) else content.encode())
    if text:
        assert text != wrong()
        Path("wrong.py").write_text(text)
    before = {path for path in tmp_path.rglob("*") if "__pycache__" not in path.parts}
    code = main([*(line or "compile wrong.py -o out").split(), "-q"])
    out, err = capsys.readouterr()
    assert (code, out) == (2, "") and err.startswith("error: ") and err.count("\n") == 1, err
    assert {path for path in tmp_path.rglob("*") if "__pycache__" not in path.parts} == before
    found = err.removeprefix("error: ").strip()
    if os.environ.get("BORESIGHT_UPDATE"):
        known = (golden() if MESSAGES.exists() else {}) | {name: found}
        messages = "".join(f"{n}\n    {known[n]}\n" for n in MISTAKES if n in known)
        MESSAGES.write_text(messages, encoding="utf-8")
    assert golden()[name] == found
