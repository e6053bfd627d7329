"""Nothing on the way from source to files uses what libraries leave open in the last bits.

The other tests here show it for the estimators at hand; this one reads the code, so that a new
function is seen before a machine is found on which it makes a difference.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.pythons

ROOT = Path(__file__).parent.parent.parent
#: Float forms of estimators, and conversions of attitudes for people and for references: nothing of
#: a program comes from them.
FLOAT = (
    "sim/rotations/rotation.py",
    "firmware/floating/build.py",
    "firmware/floating/precision.py",
    "model/recorded.py",
    "model/kalman/textbook.py",
)
#: What `compile` uses besides the rooms of the compiler.
MORE = (
    "boresight/core_files.py",
    "boresight/verbs/compile.py",
    "sim/levels/build.py",
    "sim/levels/vectors.py",
    "sim/report/data.py",
    "sim/report/numerics.py",
    "sim/report/schedule.py",
    "sim/report/sources.py",
    "sim/report/timing.py",
)
#: Functions of ``math`` that IEEE 754 or arithmetic fixes to the last bit.
EXACT_MATH = {
    *("ceil", "copysign", "fabs", "floor", "frexp", "fsum", "gcd", "inf", "isfinite", "isinf"),
    *("isnan", "isqrt", "ldexp", "nan", "nextafter", "pi", "prod", "radians", "sqrt", "trunc"),
}
#: The same of numpy: types, and functions that make, move or compare elements.
EXACT_NUMPY = set(
    [
        "False_",
        "True_",
        "__file__",
        "abs",
        "array",
        "asarray",
        "ascontiguousarray",
        "bitwise_and",
        "bitwise_or",
        "bitwise_xor",
        "bool_",
        "clip",
        "concatenate",
        "count_nonzero",
        "ctypeslib",
        "empty",
        "equal",
        "errstate",
        "float64",
        "floor",
        "frombuffer",
        "frompyfunc",
        "full",
        "generic",
        "greater",
        "greater_equal",
        "iinfo",
        "inf",
        "int32",
        "integer",
        "moveaxis",
        "ndim",
        "int64",
        "diff",
        "invert",
        "isfinite",
        "ldexp",
        "less",
        "less_equal",
        "logical_and",
        "logical_not",
        "logical_or",
        "logical_xor",
        "maximum",
        "median",
        "minimum",
        "ndarray",
        "not_equal",
        "pi",
        "sqrt",
        "stack",
        "uint8",
        "where",
        "zeros",
        "zeros_like",
    ]
)
#: Functions of the estimators that compute on arrays: the float reference, not the program.
ON_ARRAYS = {"model/ops.py": {"sin", "cos", "arcsin", "arctan2", "exp", "log", "tanh"}}
#: Methods of random generators, Python's and numpy's, that use the C library.
RANDOM = {
    *("gauss", "normalvariate", "lognormvariate", "expovariate", "vonmisesvariate", "gammavariate"),
    *("betavariate", "paretovariate", "weibullvariate", "normal", "standard_normal"),
}


def files() -> list[Path]:
    """The compiler's sources."""
    results = [p for room in ("model", "gateware", "firmware") for p in (ROOT / room).rglob("*.py")]
    results += [ROOT / name for name in MORE]
    return [p for p in results if str(p.relative_to(ROOT)) not in FLOAT]


def names_used(tree: ast.AST, module: str, short: str) -> Iterator[str]:
    """What a file takes from a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id in (module, short):
                yield node.attr
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == module:
            yield from (alias.name for alias in node.names)


def powers(tree: ast.AST) -> Iterator[str]:
    """Powers and matrix products, but for powers of two and those of `PRECISE`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Pow, ast.MatMult)):
            base = ast.unparse(node.left)
            if not (isinstance(node.op, ast.Pow) and base in ("2", "2.0")):
                yield ast.unparse(node)


def wrong(path: Path) -> list[str]:
    """What a file must not use."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    more = ON_ARRAYS.get(str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else "", set())
    results = [f"math.{n}" for n in names_used(tree, "math", "math") if n not in EXACT_MATH]
    results += [f"np.{n}" for n in names_used(tree, "numpy", "np") if n not in EXACT_NUMPY | more]
    attributes = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    return [*results, *sorted(attributes & RANDOM), *powers(tree)]


def test_the_compiler_uses_no_library_bits() -> None:
    allowed = {  # of `PRECISE`
        "model/words/tables.py": ["p ** power"],
        "model/words/polynomials.py": ["PRECISE.mpf(2) ** (x - 0.5)", "x ** k"],
    }
    results = {str(p.relative_to(ROOT)): wrong(p) for p in files()}
    assert len(results) > 130
    assert {name: uses for name, uses in results.items() if uses} == allowed


@pytest.mark.parametrize(
    "line",
    [
        "math.sin(x)",
        "from math import log2",
        "np.linalg.solve(a, b)",
        "np.exp(x)",
        "from numpy import cos",
        "from numpy.linalg import inv",
        "self.rng.gauss(0.0, 1.0)",
        "random.normalvariate(0.0, 1.0)",
        "a @ b",
        "x**0.5",
    ],
)
def test_what_is_refused(tmp_path: Path, line: str) -> None:
    file = tmp_path / "new.py"
    file.write_text(f"import math, random\nimport numpy as np\n{line}\n")
    assert wrong(file)


def test_powers_of_two_are_exact() -> None:
    """The one power that the compiler's sources do use."""
    for k in range(-1074, 1024):
        assert 2.0**k == math.ldexp(1.0, k)
