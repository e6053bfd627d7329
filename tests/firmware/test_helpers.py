"""`firmware.helpers`: only what is called, each before its callers, each against plain Python."""

import ctypes
import random
import re
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.build import find_compiler
from boresight.firmware.helpers import definitions, helpers
from boresight.model.words.fixed import Arithmetic

ALL = (
    "mul_shift",
    "shift_less",
    "negate_where",
    "sign_mask",
    "sign_mask_quarter",
    "sign_count",
    "segment_index",
    "segment_index_quarter",
    "fraction",
    "clip",
    "saturate",
    "wrap",
)


def defined(text: str) -> list[str]:
    return re.findall(r"^static inline \w+ (\w+)\(", text, flags=re.M)


def test_only_what_is_called() -> None:
    assert helpers("") == ""
    assert defined(helpers("x = fraction(y);")) == ["fraction"]
    assert defined(helpers("wrap(acc)")) == ["shift_right", "to_signed", "wrap"]


def test_definition_precedes_use() -> None:
    text = helpers(" ".join(f"{name}()" for name in ALL))
    names = defined(text)
    assert set(ALL) < set(names)
    for name in names:
        first = re.search(rf"\b{name}\(", text)
        assert first is not None
        line = text[: first.end()].splitlines()[-1]
        assert line.startswith("static inline"), name


@pytest.mark.parametrize("flags", [(), ("-U__GNUC__",)], ids=["gnu", "portable"])
@pytest.mark.parametrize("word", [18, 32])
def test_against_python(word: int, flags: tuple[str, ...], tmp_path: Path) -> None:
    arith = Arithmetic(word)
    calls = "mul_shift() sign_count() wrap() segment_index_quarter() fraction()"
    exports = [
        "uint64_t x_mul(int32_t a, int32_t b, uint32_t s) { return mul_shift(a, b, s); }",
        "uint32_t x_count(int32_t a) { return sign_count(a); }",
        "int32_t x_wrap(uint64_t a) { return wrap(a); }",
        "uint32_t x_index(int32_t a) { return segment_index_quarter(a); }",
        "int32_t x_fraction(int32_t a) { return fraction(a); }",
    ]
    text = "\n".join(["#include <stdint.h>", definitions(arith), helpers(calls), *exports, ""])
    (tmp_path / "x.c").write_text(text)
    subprocess.run(
        [find_compiler(), "-std=c99", "-O1", *flags, "-shared", "-fPIC", "x.c", "-o", "x.so"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    c = ctypes.CDLL(str(tmp_path / "x.so"))
    c.x_mul.argtypes = [ctypes.c_int32, ctypes.c_int32, ctypes.c_uint32]
    c.x_mul.restype, c.x_count.restype = ctypes.c_uint64, ctypes.c_uint32
    c.x_wrap.argtypes, c.x_index.restype = [ctypes.c_uint64], ctypes.c_uint32
    rng = random.Random(word)
    words = [0, 1, -1, 2, -2, arith.min_int, arith.max_int, 2 ** (word - 2), -(2 ** (word - 2))]
    words += [rng.randint(arith.min_int, arith.max_int) >> rng.randrange(word) for _ in range(200)]
    for a in words:
        count = sum((a if a >= 0 else ~a) < 2 ** (word - 1 - n) for n in range(1, word))
        assert c.x_count(a) == min(count, arith.norm_max)
        assert c.x_index(a) == (a + 2 ** (word - 2)) // 2**arith.fraction_bits % 128
        assert c.x_fraction(a) == a % 2**arith.fraction_bits
        for s in (0, 1, 13, 31):
            b = rng.choice(words)
            assert c.x_mul(a, b, s) == (a * b // 2**s) % 2**64
            q = a * b * 2 ** rng.randrange(2) // 2**arith.guard
            assert c.x_wrap((q * 2**arith.guard) % 2**64) == (
                (q + 2 ** (word - 1)) % 2**word - 2 ** (word - 1)
            )
