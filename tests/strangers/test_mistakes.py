"""Typical mistakes in an estimator: one line that names the author's line and a cure, code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from boresight.cli import main

pytestmark = pytest.mark.pythons

HEAD = """\
import math, random
import numpy as np
from boresight import Estimator, Input, Output, Param, State, ops

class Wrong(Estimator):
    inputs = (Input("a", -2.0, 2.0, "m"), Input("b", 0.0, 2.0, "m"))
    params = (Param("gain", 0.5, 0.0, 1.0),)
    states = (State("pos", -4.0, 4.0, "m"),)
    outputs = (Output("y", "m"),)

"""
STEP = "    def step(self, x, u, p):  #0\n"
RETURN = '        return {"pos": 0.5 * x.pos}, {"y": y}\n'

#: What stands between STEP and RETURN, what the line says is found, and its cure.
#: The line to be named is marked.
INSIDE = {
    "float power": ("y = u.b ** 0.5  #!", "0.5", "ops.sqrt(x) for x**0.5"),
    "traced power": ("y = u.b ** u.a  #!", "a traced leaf", "ops.exp(n * ops.log(x))"),
    "power of a number": ("y = 2.0 ** u.a  #!", "a traced value as a power", "ops.exp("),
    "negative power": ("y = u.a ** -2  #!", "this product in [0, 4]", "ops.maximum(x, SM"),
    "np.sin": ("y = np.sin(u.a)  #!", "numpy's sin of a", "use boresight.ops (sincos_ht"),
    "np.sqrt of an array": ("y = np.sqrt(np.array([u.b]))[0]  #!", "numpy's sqrt of a",
                            "use boresight.ops"),
    "np.linalg.norm": ("y = np.linalg.norm([u.a, u.b])  #!", "found ", "use"),
    "np.maximum": ("y = np.maximum(u.a, u.b)  #!", "max, min of a traced", "ops.maximum"),
    "math.sin": ("y = math.sin(u.a)  #!", "a function of math", "boresight.ops"),
    "float()": ("y = 2.0 * float(u.a)  #!", "float()", "numbers stay as they are"),
    "int()": ("y = [1.0, 2.0][int(u.b)]  #!", "as a whole number", "ops.where"),
    "round()": ("y = round(u.b)  #!", "as a whole number", "ops.where"),
    "index": ("y = [1.0, 2.0][u.b]  #!", "as a whole number", "ops.where"),
    "bool()": ("y = 1.0 if bool(u.a) else 0.0  #!", "found if, and,", "ops.where(condition, yes"),
    "if": ("y = u.a\n        if u.a > 0.0:  #!\n            y = u.b", "found if, and,",
           "ops.where("),
    "and": ("y = ops.where(u.a > 0.0 and u.b > 1.0, 1.0, 0.0)  #!", "found if, and", "& | ~"),
    "chained": ("y = ops.where(0.0 < u.a < 1.0, 1.0, 0.0)  #!", "found if, and", "& | ~"),
    "max()": ("y = max(u.a, u.b)  #!", "found if, and, or, not, max", "ops.maximum"),
    "==": ("y = ops.where(u.a == 0.0, 1.0, 0.0)  #!", "== or !=", "ops.absolute(a - b) < 0.5"),
    "& without brackets": ("y = ops.where(u.a > 0.0 & u.b, 1.0, 0.0)  #!", "& | ^ ~ of", "compare"),
    "condition of a number": ("y = ops.where(u.a, 1.0, 0.0)  #!", "found a number", "compare it"),
    "condition as a number": ("y = u.a + (u.b > 1.0)  #!", "a condition as a number", "ops.where("),
    "remainder": ("y = u.a % 2.0  #!", "% or //", "ops.wrap_ht"),
    "len": ("y = u.a * len(u.b)  #!", "TypeError: ", "without elements"),
    "element": ("y = u.a[0]  #!", "TypeError: ", "without elements"),
    "forgotten *": ("y = u.a(1.0 - u.b)  #!", "not callable", "write a * before"),
    "typo in an input": ("y = u.aa  #!", "'aa'", "declared inputs: a, b"),
    "typo in a state": ("y = x.poss  #!", "'poss'", "declared states: pos"),
    "typo in a parameter": ("y = p.gian * u.a  #!", "'gian'", "declared parameters: gain"),
    "typo in ops": ("y = ops.cosine(u.a)  #!", "no attribute 'cosine'", "correct the name"),
    "name": ("y = 2.0 * a  #!", "NameError: ", "correct the name"),
    "recursion": ("y = self.step(x, u, p)  #!", "RecursionError", "no recursion: the result"),
    "argument left out": ("y = ops.where(u.a > 0.0, 1.0)  #!", "'no'", "the arguments of the call"),
    "exit": ("raise SystemExit(0)  #!", "SystemExit: 0", "a step of wrong that computes"),
    "exception": ("y = {}['gain']  #!", "KeyError: 'gain'", "a step of wrong that computes"),
    "random": ("y = u.a * random.random()  #!", "another expression the second", "no random numb"),
    "not a number": ("y = u.a * math.nan  #!", "nan", "correct how it is computed"),
    "array as operand": ("y = ops.maximum(u.a, np.ones(2))  #!", "shape (2,)", "one element at a"),
    "shapes": ("y = (np.ones((3, 3)) @ np.array([u.a, u.b]))[0]  #!", "ValueError", "the shapes"),
    "None as operand": ("y = u.a * None  #!", "None", "wanted a number"),
    "divisor 0": ("y = u.a / 0.0  #!", "found 0", "correct it"),
    "divisor through 0": ("y = 1.0 / u.a  #!", "found a in [-2, 2]", "ops.maximum(x, SMALLEST)"),
    "named divisor": ('d = ops.named("speed", u.a - u.b)\n        y = 1.0 / d  #!',
                      "speed in [-4, 2]",
                      "ops.clip"),
    "divisor without a name": ("d = u.a - u.b\n        y = 1.0 / d  #!",
                               "this sum of wrong.py, line 12 in [-4, 2]", "ops.clip"),
    "asin below 0": ("y = ops.asin_ht(0.2 * u.a)  #!", "this product in [-0.4, 0.4]", "angles"),
    "root of a negative": ("y = ops.sqrt(u.b - u.a)  #!", "this sum in [-2, 4]",
                           "ops.maximum(x, 0.0)"),
    "root of another line": ("d = u.b - u.a\n        y = ops.sqrt(d)  #!",
                             "this sum of wrong.py, line 12 in [-2, 4]", "ops.maximum(x, 0.0)"),
    "root of the same line": ("y = ops.sqrt(u.b - u.a)  #!", "found this sum in [-2, 4]",
                              "ops.maximum(x, 0.0)"),
    "log through 0": ("y = ops.log(u.b)  #!", "found b in [0, 2]", "ops.maximum(x, SMALLEST)"),
    "exp of a constant": ("y = u.b + ops.exp(u.a - u.a + 800.0)  #!", "inf", "finite constants"),
    "exp too large": ("y = ops.exp(400.0 * u.a)  #!", "this product in [-800, 800]", "ops.clip"),
    "asin": ("y = ops.asin_ht(u.a)  #!", "found a in [-2, 2]", "algebra.angles.asin_ht"),
    "no finite range": ("y = ops.rsqrt(u.b)  #!", "found y in [0.707107, inf]", "ops.bounded"),
    "far too large": ("y = ops.wrap_ht(1e300 * u.a)  #!", "y in [-1, 1]", "nearer to 1"),
    "beyond the word": ('y = ops.bounded(u.a * 2.0**300, -1.0, 1.0, "small")  #!',
                        "280 bits too many",
                        "narrow its factors"),
    "limits out of order": ("y = ops.clip(u.a, 1.0, -1.0)  #!", "(1.0, -1.0)", "in order"),
    "root of a number": ("y = u.a * ops.sqrt(-2.0)  #!", "ValueError: ", "a step"),
    "bound of a value": ("y = ops.bounded(u.a, 0.0, u.b, 'x')  #!", "of a traced value", "ops.max"),
    "bound out of order": ("y = ops.bounded(u.a, 1.0, -1.0, 'x')  #!", "(1.0, -1.0)",
                           "finite and ordered"),
}  # fmt: skip
#: Other texts for RETURN.
RETURNED = {
    "one dictionary": ('return {"y": y}', "found dict", "return {states by name}, {outputs"),
    "nothing": ("pass", "found NoneType", "return {states by name}, {outputs by name}"),
    "three": ('return {"pos": y}, {"y": y}, y', "found tuple", "return {states by name}, {out"),
    "lists": ("return [y], [y]", "found list and list", "return {states by name}, {outputs"),
    "forgotten state": ('return {}, {"y": y}', "found none", "return it with the states"),
    "unknown state": ('return {"pos": y, "vel": y}, {"y": y}', "not declared", "state vel: wanted"),
    "extra output": ('return {"pos": y}, {"y": y, "z": y}', "not declared", "output z: wanted"),
    "condition": ('return {"pos": y}, {"y": y > 0.0}', "found a condition",
                  "ops.where(condition, 1.0"),
    "array": ('return {"pos": y}, {"y": np.array([y, y])}', "shape (2,)", "its elements"),
    "nan": ('return {"pos": y}, {"y": math.nan}', "found nan", "wanted a finite number"),
    "constant": ('return {"pos": 9.0}, {"y": y}', "found 9.0", "wanted a constant in [-4, 4]"),
    "text": ('return {"pos": y}, {"y": "high"}', "found a str, 'high'", "wanted a number"),
    "None": ('return {"pos": y}, {"y": None}', "output y: wanted a number, found None",
             "compute it from states"),
}  # fmt: skip
#: What is replaced in HEAD or STEP, by what; found; cure.
DECLARED = {
    "default": ('0.5, 0.0, 1.0),)', '5.0, 0.0, 1.0),)  #!', "found 5",
                "correct the default or the"),
    "a text": ('Param("gain", 0.5,', 'Param("gain", "0.5",  #!\n       ',
               "parameter gain: wanted default: a number, found '0.5'", "without quotes"),
    "a text as tolerance": ('Output("y", "m"),)', 'Output("y", "m", "1e-3"),)  #!',
                            "output y: wanted tolerance: a number, found '1e-3'", "without"),
    "sd": ('4.0, "m"),)', '4.0, "m", sd=1.0),)  #!', "'sd'", "take State from boresight.kalman"),
    "initial": ('4.0, "m"),)', '4.0, "m", 9.0),)  #!', "found 9", "correct the initial value"),
    "backwards": ('"b", 0.0, 2.0, "m"))', '"b", 2.0, 0.0, "m"))  #!', "[2, 0]", "low < high"),
    "infinite": ('"b", 0.0, 2.0, "m"))', '"b", 0.0, math.inf))  #!', "[0, inf]", "a finite range"),
    "no name": ('Input("b", 0.0, 2.0, "m"))', 'Input(0.0, 2.0, "m"))  #!', "found 'm'",
                "a name, then"),
    "twice": ('Input("b", 0.0, 2.0, "m"))', 'Input("a", 0.0, 2.0))  #!', "a twice", "rename one"),
    "one, not a tuple": ('(Output("y", "m"),)', 'Output("y", "m")', "one Output",
                         "also where there is only"),
    "names for outputs": ('(Output("y", "m"),)', '("y",)', "found str", "outputs = (Output(...),)"),
    "no outputs": ('(Output("y", "m"),)', "()", "found none", "declare outputs"),
    "a rate alone": ('    states = (', "    rates_hz = 100.0\n    states = (", "found float; write",
                     'rates_hz = {"dt": 100.0}'),
    "rate of nothing": ('    states = (', '    rates_hz = {"dt": 9.0, "xx": 9.0}\n    states = (',
                        "found 'xx'; write", "of the log (dt)"),
    "rate of an input alone": ('    states = (', '    rates_hz = {"a": 9.0}\n    states = (',
                               "found a alone; write", "of the log (dt)"),
    "rate of 0": ('    states = (', '    rates_hz = {"dt": 0.0}\n    states = (', "found dt: 0.0;",
                  "samples a second"),
    "flag of nothing": ('"b", 0.0, 2.0, "m"))', '"b", 0.0, 1.0, valid_of="z"))  #!', "found z",
                        "choose a"),
    "step without p": ("(self, x, u, p):  #0", "(self, x, u):  #!", "step(x, u)",
                       "take these three"),
    "no inputs": ('    inputs = (Input("a"', '    others = (Input("a"', "found none",
                  "declare one, for example"),
    "called as an input": ('Param("gain", 0.5, 0.0, 1.0),)', 'Param("b", 0.5, 0.0, 1.0),)  #!',
                           "'b'", "wanted a name that no input or state has"),
    "no step": ("def step", "def steps", "found none", "write it: it gets states, inputs, param"),
    "syntax": ("def step(self, x, u, p):  #0", "def step(self, x, u, p)  #!", "SyntaxError",
               "correct it"),
    "import": ("import math, random\n", "import math, random, nosuch  #!\n",
               "ModuleNotFoundError: ", "correct"),
    "argument": ('4.0, "m"),)', '4.0, "m", init=1.0),)  #!',
                 "TypeError: ", "correct it"),
}  # fmt: skip


def refused(text: str, capsys: pytest.CaptureFixture[str], name: str = "wrong.py") -> str:
    """The line that `compile` says, and that it says no more."""
    Path("wrong.py").write_text(text)
    assert main(["compile", name, "-o", "out", "--quiet"]) == 2
    said = capsys.readouterr()
    assert not said.out and not Path("out").exists()
    assert said.err.startswith("error: ") and said.err.count("\n") == 1
    return said.err


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def named(text: str) -> int:
    """The line that has to be named: the marked one, else where the class begins."""
    lines = text.splitlines()
    marked = [k for k, line in enumerate(lines, 1) if line.endswith("#!")]
    return marked[0] if marked else lines.index("class Wrong(Estimator):") + 1


def check(text: str, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """The line names the place, what was found, and what to do."""
    result = refused(text, capsys)
    assert result.startswith(f"error: wrong.py, line {named(text)}"), result
    for word in words:
        assert word in result, result


@pytest.mark.pythons
@pytest.mark.parametrize("name", INSIDE)
def test_inside_step(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    body, *words = INSIDE[name]
    check(f"{HEAD}{STEP}        {body}\n{RETURN}", tuple(words), capsys)


@pytest.mark.parametrize("name", RETURNED)
def test_what_step_returns(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text, *words = RETURNED[name]
    step = STEP.replace("#0", "#!")
    check(f"{HEAD}{step}        y = 0.5 * x.pos\n        {text}\n", tuple(words), capsys)


@pytest.mark.pythons
@pytest.mark.parametrize("name", DECLARED)
def test_declarations(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, *words = DECLARED[name]
    good = f"{HEAD}{STEP}        y = u.a\n{RETURN}"
    assert good.count(old) == 1
    check(good.replace(old, new), tuple(words), capsys)


def test_a_class_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    result = refused(f"{HEAD}{STEP}        y = u.a\n{RETURN}", capsys, "wrong.py:Right")
    assert result.endswith("found Wrong; name one: wrong.py:Wrong\n")


#: Declarations and a step that are too much for a core; what the line says.
TOO_MUCH = {
    "states": (
        "    states = tuple(State(f's{k}', -1.0, 1.0) for k in range(130))\n",
        "return {f's{k}': 0.5 * getattr(x, f's{k}') for k in range(130)}, {'y': u.a}",
        "130 states, the small machine has room for 128; config small-1024 has more",
    ),
    "parameters": (
        "    params = tuple(Param(f'p{k}', 0.5, 0.0, 1.0) for k in range(300))\n",
        "return {'pos': 0.5 * x.pos}, {'y': u.a * sum(getattr(p, f'p{k}') for k in range(300))}",
        "300 parameters, the small machine has 256 registers for them; config small-1024",
    ),
    "constants": (
        "",
        "return {'pos': 0.5 * x.pos}, {'y': sum(k / 997 * u.a for k in range(1, 560, 2))}  #!",
        " constants and 1 parameters, the small machine has 256 registers for them; config small",
    ),
    "microwords": (
        "",
        "y = u.a\n        for k in range(2400):\n"
        "            y = ops.bounded(y * u.b, -4.0, 4.0, '')  #!\n"
        "        return {'pos': 0.5 * x.pos}, {'y': y}",
        "microwords or more, the small machine has 16384; compute less in a sample",
    ),
}


@pytest.mark.parametrize("name", TOO_MUCH)
def test_more_than_a_core_holds(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The line says what is missing, who has more, and which line of the estimator takes most."""
    declared, step, said = TOO_MUCH[name]
    Path("wrong.py").write_text(text := f"{HEAD}{declared}{STEP}        {step}\n")
    assert main(["compile", "wrong.py", "-o", "out", "--quiet"]) == 2
    result = capsys.readouterr().err
    assert result.startswith("error: wrong: ") and result.count("\n") == 1 and said in result
    if "#!" in text:
        assert f"operations: wrong.py, line {named(text)} (" in result
