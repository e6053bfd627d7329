"""Mistakes in estimators and inputs: one line with the place and a cure, exit code 2."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from boresight.cli import main
from tests.support.strangers import program

# -- `boresight check` names what is wrong: the value, its line, and a cure -----------------------

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


# -- what strangers get wrong: one line with the place, exit code 2, nothing left behind ----------

HEAD = "from boresight import Estimator, Input, Output, Param, State, World, ops\n"
GOOD = """
class Lag(Estimator):
    inputs = (Input("x", -10.0, 10.0, "m"),)
    states = (State("y", -10.0, 10.0, "m"),)
    outputs = (Output("y", "m", tolerance=1e-6),)
    def step(self, x, u, p):
        y = x.y + 0.25 * (u.x - x.y)
        return {"y": y}, {"y": y}
"""
WORLD = """
class Plant(World):
    def start(self):
        self.k = 0
    def record(self, outputs):
        self.k += 1
        RECORD
"""
RECORDS = {
    "raises": 'return {"x": 1.0 / (3 - self.k)}',
    "list": "return [1.0]",
    "lacks": 'return {"z": 1.0}',
    "beyond": 'return {"x": 4.0 * self.k}',
    "text": 'return {"x": "one"}',
    "nan": 'return {"x": float("nan")}',
    "infinite": 'return {"x": float("inf")}',
    "empty": "return None",
    "truth": 'return {"x": 1.0, "y_true": "high"}',
    "later": 'return {"x": 1.0} if self.k < 3 else {}',
}
FILES = {
    "good.py": HEAD + GOOD,
    "two.py": HEAD + GOOD + GOOD.replace("Lag", "Lead"),
    "none.py": HEAD,
    "syntax.py": HEAD + "class Lag(Estimator)\n    pass\n",
    "raises.py": HEAD + "scale = {}['gain']\n" + GOOD,
    "module.py": "import nosuchmodule\n" + HEAD + GOOD,
    "exits.py": "raise SystemExit(0)\n",
    "step.py": HEAD + GOOD.replace("u.x - x.y", "u.z - x.y"),
    "branch.py": HEAD + GOOD.replace("        return", "        if y > 0: y = -y\n        return"),
    "forgets.py": HEAD + GOOD.replace('return {"y": y}, ', "return {}, "),
    "silent.py": HEAD + GOOD.replace(', {"y": y}', ", {}"),
    "nothing.py": HEAD + GOOD.replace('return {"y": y}, {"y": y}', "pass"),
    "list.py": HEAD + GOOD.replace('return {"y": y}, {"y": y}', "return [y], [y]"),
    "value.py": HEAD + GOOD.replace('return {"y": y}', 'return {"y": "high"}'),
    "condition.py": HEAD + GOOD.replace(', {"y": y}', ', {"y": y > 0.0}'),
    "numpy.py": "import math\n" + HEAD + GOOD.replace("0.25 *", "math.sin(x.y) *"),
    "backwards.py": HEAD + GOOD.replace('"x", -10.0, 10.0', '"x", 10.0, -10.0'),
    "initial.py": HEAD + GOOD.replace('"y", -10.0, 10.0, "m"', '"y", -10.0, 10.0, "m", 11.0'),
    "default.py": HEAD
    + GOOD.replace("    states", '    params = (Param("k", 2, 0, 1),)\n    states'),
    "twice.py": HEAD + GOOD.replace('10.0, "m"),)\n    outputs', '10.0, "m"),) * 2\n    outputs'),
    "tolerance.py": HEAD + GOOD.replace("tolerance=1e-6", "tolerance=-1.0"),
    "unit.py": HEAD + GOOD.replace('10.0, "m"),)\n    states', '10.0, "furlings"),)\n    states'),
    "radians.py": HEAD
    + GOOD.replace('10.0, "m"', '10.0, "rad"', 1).replace("0.25", "ops.sincos_ht(0.1 - u.x)[0]"),
    "degrees.py": HEAD
    + GOOD.replace('10.0, "m")', '10.0, "deg")').replace("u.x -", "ops.wrap_ht(abs(-x.y) + 1.0) -"),
    "tuple.py": HEAD + GOOD.replace('10.0, "m"),)\n    states', '10.0, "m"))\n    states'),
    "string.py": HEAD + GOOD.replace('"x", -10.0', '"x", "low"'),
    "needs.py": HEAD + GOOD.replace("    inputs", "    def __init__(self, n): pass\n    inputs"),
    "log.csv": "x\n" + "1\n2\n3\n",
    "unknown.csv": "x[furlongs/fortnite]\n1\n2\n",
    "dimension.csv": "t[s],x[m/s]\n0,1\n1,2\n",
    "other.csv": "t,z\n0,1\n1,2\n",
    "gap.csv": "t,x\n0,1\n1,\n2,3\n",
    "nan.csv": "t,x\n0,1\n1,nan\n2,3\n",
    "far.csv": "t,x[km]\n0,0.001\n1,0.002\n2,0.03\n",
    "bracket.csv": "x[m\n1\n",
    **{f"world_{n}.py": HEAD + WORLD.replace("RECORD", r) for n, r in RECORDS.items()},
}


@pytest.fixture
def refused(tmp_path, capsys, monkeypatch):
    """A function that runs a command line in a folder of files, and gives its one line."""
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).write_text(content)
    (tmp_path / "folder.py").mkdir()

    def things() -> set[Path]:
        return {p for p in tmp_path.rglob("*") if "__pycache__" not in p.parts}

    before = things()

    def run(line: str) -> str:
        try:
            code = main([*line.split(), "-q"])
        except SystemExit as stop:
            code = stop.code
        said = capsys.readouterr()
        error = said.err.splitlines()
        assert code == 2, said
        assert said.out == "" and len(error) == 1 and error[0].startswith("error: "), said
        assert things() == before
        return error[0]

    return run


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("run nosuch.py log.csv", "nosuch.py: wanted a Python file with an estimator, found no"),
        ("run folder.py log.csv", "folder.py: wanted a Python file with an estimator, found is a"),
        ("compile nosuch.py:Lag -o x", "nosuch.py: wanted a Python file with an estimator"),
        ("run syntax.py log.csv", "syntax.py, line 2: wanted a file that imports, found SyntaxEr"),
        ("run raises.py log.csv", "raises.py, line 2: wanted a file that imports, found KeyError"),
        ("run module.py log.csv", "module.py, line 1: wanted a file that imports, found ModuleN"),
        ("run exits.py log.csv", "exits.py, line 1: wanted a file that imports, found SystemExit"),
        ("run none.py log.csv", "none.py: wanted one class derived from boresight.Estimator, fou"),
        ("run two.py log.csv", "found Lag, Lead; name one: two.py:Lag"),
        ("run two.py:Lug log.csv", "two.py: wanted a class Lug derived from boresight.Estimator"),
        ("run two.py:ops log.csv", "found ops, not derived from Estimator; name one: two.py:Lag"),
        ("run good.py:Lag(n=2) log.csv", "good.py:Lag(n=2): wanted arguments that Lag takes, fou"),
        ("run good.py:Lag(n=f()) log.csv", "wanted file.py:Class or file.py:Class(NAME=VALUE)"),
        ("run needs.py log.csv", "needs.py: wanted arguments that Lag takes, found TypeError"),
        ("run needs.py:Lag(n) log.csv", "wanted file.py:Class or file.py:Class(NAME=VALUE)"),
        ("run step.py log.csv", "step.py, line 8: wanted one of the declared inputs: x"),
        (
            "run step.py log.csv --levels numpy",
            "step.py, line 8: wanted one of the declared inputs: x",
        ),
        (
            "run step.py log.csv --levels float",
            "step.py, line 8: wanted one of the declared inputs: x",
        ),
        (
            "run value.py log.csv --levels float",
            "step of lag, state y: wanted a number, found a str",
        ),
        (
            "run branch.py log.csv --levels float",
            "branch.py, line 9: wanted operations that can be rec",
        ),
        (
            "run numpy.py log.csv --levels float",
            "numpy.py, line 9: wanted operations that can be rec",
        ),
        ("check step.py log.csv", "step.py, line 8: wanted one of the declared inputs: x"),
        ("compile step.py -o x", "step.py, line 8: wanted one of the declared inputs: x"),
        ("compile branch.py -o x", "branch.py, line 9: wanted operations that can be rec"),
        ("compile forgets.py -o x", "step of lag, state y: wanted each declared state once: y, f"),
        (
            "run forgets.py log.csv --levels numpy",
            "step of lag, state y: wanted each declared state",
        ),
        ("run silent.py log.csv", "step of lag, output y: wanted each declared output once: y, f"),
        ("run nothing.py log.csv", "step of lag: wanted two dictionaries: next states, outputs, "),
        (
            "run list.py log.csv",
            "step of lag: wanted two dictionaries: next states, outputs, found list and list",
        ),
        ("run value.py log.csv", "step of lag, state y: wanted a number, found a str"),
        (
            "run condition.py log.csv",
            "output y: wanted a number, found a condition; write ops.where(",
        ),
        ("run numpy.py log.csv", "numpy.py, line 9: wanted operations that can be rec"),
        ("run backwards.py log.csv", "input x: wanted a finite range with low < high, found [10,"),
        ("run initial.py log.csv", "state y: wanted initial value in [-10, 10], found 11"),
        ("run default.py log.csv", "parameter k: wanted default in [0, 1], found 2"),
        ("run twice.py log.csv", "estimator lag: wanted each state once, found y twice"),
        ("run tolerance.py log.csv", "output y: wanted a tolerance of 0 or more, found -1.0"),
        ("run tuple.py log.csv", "estimator lag, inputs: wanted a tuple of Input, found one Input"),
        ("run string.py log.csv", "string.py, line 4, input x: wanted a name, then num"),
        ("run good.py unknown.csv", "column x: wanted a unit that converts to m, found furlongs/"),
        ("run good.py dimension.csv", "column x: wanted a unit that converts to m, found m/s"),
        (
            "run unit.py dimension.csv",
            "unit.py, line 4, input x: wanted a unit as m/s^2, deg/s or uT",
        ),
        (
            "check radians.py log.csv",
            "radians.py, line 8: wanted an angle in half turns, found rad",
        ),
        ("compile degrees.py", "degrees.py, line 8: wanted an angle in half turns, found deg"),
        ("run good.py other.csv", "other.csv: wanted a column x [m], an input of lag, found"),
        ("run good.py gap.csv", "gap.csv, line 3, column x: wanted a number, found no value"),
        ("run good.py nan.csv", "nan.csv, line 3, column x: wanted a number, found no value; c"),
        ("run good.py far.csv", "far.csv, line 4, column x: wanted -10 to 10 m, the declared ra"),
        ("check good.py far.csv", "far.csv, line 4, column x: wanted -10 to 10 m, the declared r"),
        ("run good.py bracket.csv", "wanted column names like gx or gx[deg/s], found 'x[m'"),
        ("run good.py world_raises.py", "world plant, step 2, world_raises.py, line 8: want"),
        ("run good.py world_list.py", "world plant, step 0: wanted a record: values by inp"),
        ("run good.py world_lacks.py", "world plant, step 0, x: wanted a value for every i"),
        (
            "run good.py world_beyond.py",
            "world plant, step 2, x: wanted -10 to 10 m, the declared range, found 12",
        ),
        ("run good.py world_text.py", "world plant, step 0, x: wanted a number, found str"),
        ("run good.py world_nan.py", "world plant, step 0, x: wanted a number, found no va"),
        ("run good.py world_infinite.py", "world plant, step 0, x: wanted a finite number, fou"),
        ("run good.py world_empty.py", "world plant: wanted at least one record, found none"),
        ("run good.py world_truth.py", "world plant, step 0, y_true: wanted a number, foun"),
        ("run good.py world_later.py", "world plant, step 2, x: wanted a value for every in"),
        ("run good.py world_later.py -o x", "world plant, step 2, x: wanted a value for ev"),
        ("run good.py good.py", "good.py: wanted one class derived from boresight.World"),
        ("run world_list.py", "run: wanted an estimator and a log, a world or board, found world"),
        (
            "run good.py world_list.py --levels tin",
            "levels: wanted one of numpy, float, fixed, c, r",
        ),
    ],
)
def test_mistakes(line: str, message: str, refused) -> None:
    assert message in refused(line)


def test_a_wrong_unit_of_a_program_names_row_and_column(refused, tmp_path) -> None:
    (tmp_path / "log.csv").write_text("dt,z[km]\n0.01,0.05\n0.01,0.2\n")
    line = refused(f"check {program('kalman.py')} log.csv")
    assert "log.csv, line 3, column z: wanted -100 to 100 m, the declared range, found 200" in line
