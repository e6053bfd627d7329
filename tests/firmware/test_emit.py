"""The emitted C: same text for the same program, no warning, no undefined behaviour."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from boresight.firmware.build import CModel, find_compiler, host_source, observe_source
from boresight.firmware.emit import Body, emit_c
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import (
    Kind,
    Negate,
    Op,
    Overflow,
    Port,
    Program,
    Scale,
    Term,
    Value,
    When,
)
from tests.support.random_program import random_inputs, random_program, with_ranges

# -- `firmware.emit`: same text for the same program, no warning, no undefined behaviour ----------
# ``BORESIGHT_UPDATE=1 pytest tests/firmware/test_emit.py`` rewrites the golden header.

GOLDEN = Path(__file__).parent / "golden" / "golden.h"
STRICT = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-Wstrict-prototypes",
    "-Werror",
    "-pedantic",
)

MAIN = """
#include "p_host.c"
#include <stdio.h>
void p_observe(p_t *, size_t, const int32_t *, int32_t *, int32_t *, int64_t *, int64_t *,
    int64_t *);
int main(void) {
    static int32_t inputs[@n_in@], outputs[@n_out@], words[2][@n_values@];
    static int64_t counts[3][@n_values@];
    uint8_t flags;
    p_t p;
    p_init(&p);
    while (fread(inputs, sizeof inputs, 1, stdin) == 1) {
        p_t copy = p;
        p_observe(&copy, 1, inputs, words[0], words[1], counts[0], counts[1], counts[2]);
        p_run(&p, 1, 1, inputs, outputs, &flags, NULL);
        fwrite(outputs, sizeof outputs, 1, stdout);
        fputc(flags, stdout);
    }
    return 0;
}
"""


def write(files: dict[str, str], folder: Path) -> None:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def all_files(program: Program) -> dict[str, str]:
    """Firmware, and what a host adds."""
    body = Body(program)
    return {
        **emit_c(program),
        f"{body.name}_host.c": host_source(body.name, len(program.states)),
        f"{body.name}_observe.c": observe_source(body),
    }


def compile_(folder: Path, *arguments: str) -> None:
    done = subprocess.run([find_compiler(), *arguments], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def golden_program() -> Program:
    """A small complete program: turns an angle, filters, clamps."""
    kinds = Kind
    values = (
        Value("rate", kinds.INPUT, 27, -16.0, 16.0, "declared", "rad/s"),
        Value("dt", kinds.CONST, 37, 0.005, 0.005, "constant", "s", 687194767),
        Value("gain", kinds.PARAM, 31, 0.0, 1.0, "declared", "", 1 << 29),
        Value("angle_ht", kinds.STATE, 31, -1.0, 1.0, "declared", "half turns"),
        Value("turned_ht", kinds.OP, 31, -1.0, 1.0, "WRAP", "half turns"),
        Value("sine", kinds.OP, 30, -1.0, 1.0, "interval"),
        Value("smooth", kinds.OP, 27, -16.0, 16.0, "interval", "rad/s"),
    )
    ops = (
        Op(4, (Term(3, 1, 29), Term(0, 1, 26)), Overflow.WRAP),
        Op(
            5,
            (Term(4, None, 24, 1, fraction_a=True), Term(1, None, 30, 0, negate=Negate.IF)),
            flag=4,
            flag_quarter=True,
            index=4,
            index_quarter=True,
            table=0,
        ),
        Op(
            6,
            (Term(0, 2, 23), Term(0, 5, 25, scale=Scale.FULL, when=When.UNLESS)),
            Overflow.CLIP,
            flag=0,
            norm=0,
        ),
    )
    table = tuple(k * 4099 - 2**20 for k in range(512))
    return Program(
        "golden", Arithmetic(), values, ops, (0,), (4, 6), ("angle_ht", "smooth"), ((3, 4),), table
    )


def test_golden_header() -> None:
    """What a caller includes; the words that the C computes are compared below, not its text."""
    text, path = emit_c(golden_program())["golden.h"], GOLDEN
    if os.environ.get("BORESIGHT_UPDATE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8"), (
        "the emitted text changed; if that is meant: BORESIGHT_UPDATE=1 pytest " + __file__
    )


def test_same_program_same_text() -> None:
    program = random_program(7)
    files = emit_c(program)
    assert list(files) == [f"{program.name}.h", f"{program.name}.c"]
    code = (
        "from boresight.firmware.emit import emit_c;"
        "from tests.support.random_program import random_program;"
        "import sys; sys.stdout.write(''.join(emit_c(random_program(7)).values()))"
    )
    for seed in ("1", "2"):
        root = Path(__file__).parents[2]
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=root,
            check=True,
            text=True,
            capture_output=True,
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(root)},
        )
        assert done.stdout == "".join(files.values())


def test_outputs_have_their_units() -> None:
    """Also where the value that is one has none of its own, as any computed one."""
    golden = golden_program()
    values = tuple(replace(v, unit="" if v.kind is Kind.OP else v.unit) for v in golden.values)
    ports = (Port("angle_ht", "ht"), Port("smooth", "rad/s"))
    header = emit_c(replace(golden, values=values, ports=ports))["golden.h"]
    assert "    int32_t smooth; // fixed<32,5>, rad/s, [-16, 16]" in header
    assert "#define GOLDEN_OUT_SMOOTH_FRAC 27 // fixed<32,5>, rad/s, [-16, 16]" in header


def test_output_that_bears_the_name_of_an_input(odd_names: Program) -> None:
    header = emit_c(replace(odd_names, name="odd"))["odd.h"]
    names = [line.split()[1] for line in header.split("\n") if line.startswith("#define ")]
    assert len(set(names)) == len(names)
    assert "#define ODD_IN_INT__FRAC (-3) // fixed<32,35>, µT _, [-1e+09, 1]" in header
    assert "#define ODD_OUT_INT__FRAC 40 // fixed<32,-8>, [-1e-09, 1]" in header


def test_inputs_that_differ_in_case() -> None:
    values = [Value(name, Kind.INPUT, 31, -1.0, 1.0, "test") for name in ("Vs", "vs")]
    program = Program("x", Arithmetic(), tuple(values), (), (0, 1), (0,), ("y",), (), ())
    header = emit_c(program)["x.h"]
    assert "#define X_IN_VS_FRAC 31 " in header and "#define X_IN_VS_2_FRAC 31 " in header


@pytest.mark.parametrize(
    "which", ["random_18", "random_24", "random_32", "corner", "odd", "empty", "golden"]
)
def test_no_warning(
    which: str, tmp_path: Path, corner: Callable[[int], Program], odd_names: Program, empty: Program
) -> None:
    programs = {
        "corner": lambda: corner(24),
        "odd": lambda: odd_names,
        "empty": lambda: empty,
        "golden": golden_program,
    }
    program = (
        programs[which]()
        if which in programs
        else with_ranges(random_program(3, word=int(which[-2:]), n_ops=60), 3)
    )
    write(all_files(replace(program, name="p")), tmp_path)
    compile_(tmp_path, *STRICT, "-O2", "-c", "p.c")
    compile_(tmp_path, *STRICT, "-O0", "-c", "p_host.c")
    compile_(tmp_path, *STRICT, "-O0", "-c", "p_observe.c")


def test_integers_only_and_nothing_allocated() -> None:
    text = "".join(all_files(random_program(5)).values())
    assert not any(word in text for word in ("float", "double", "malloc", "calloc", "alloca"))


@pytest.mark.parametrize("word", [18, 24, 32])
@pytest.mark.parametrize("kind", ["random", "corner"])
def test_no_undefined_behaviour(
    word: int,
    kind: str,
    tmp_path: Path,
    corner: Callable[[int], Program],
    corner_rows: Callable[[int], list[list[int]]],
) -> None:
    if kind == "random":
        program = random_program(word, word=word, n_ops=80)
        rows = random_inputs(program, word, 300)
    else:
        program, rows = corner(word), corner_rows(word)
    write(all_files(replace(program, name="p")), tmp_path)
    text = MAIN
    for name, count in (
        ("@n_in@", len(program.inputs)),
        ("@n_out@", len(program.outputs)),
        ("@n_values@", len(program.values)),
    ):
        text = text.replace(name, str(count))
    (tmp_path / "main.c").write_text(text)
    compile_(
        tmp_path,
        *STRICT,
        "-O0",
        "-g",
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover=all",
        "main.c",
        "p_observe.c",
        "-o",
        "main",
    )
    words = np.array(rows, dtype=np.int32)
    done = subprocess.run(
        [tmp_path / "main"],
        input=words.tobytes(),
        capture_output=True,
        env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"},
    )
    assert done.returncode == 0, done.stderr.decode()
    record = np.dtype([("outputs", np.int32, len(program.outputs)), ("flags", np.uint8)])
    got = np.frombuffer(done.stdout, dtype=record)
    outputs, saturated = Interpreter(program).run(np.array(rows)[:, :, None])
    np.testing.assert_array_equal(got["outputs"], outputs[:, :, 0])
    flags = saturated[:, 0] + 2 * program.beyond(np.array(rows))
    np.testing.assert_array_equal(got["flags"], flags)


# -- runs side by side: each gives the words of a model of its own ------------------------------


@pytest.mark.parametrize("seed, word", [(3, 32), (4, 18)])
def test_each_is_a_model_of_its_own(seed: int, word: int) -> None:
    program, runs, steps = random_program(seed, word=word), 3, 20
    words = np.array(random_inputs(program, seed, steps * runs)).reshape(steps, runs, -1)
    many = CModel(program, runs)
    for _ in range(2):  # and again after a reset
        pieces = [many.trajectory(piece) for piece in (words[:1], words[1:])]
        found = [np.concatenate(x) for x in zip(*pieces, strict=True)]
        for k in range(runs):
            alone = CModel(program).trajectory(words[:, k])
            for ours, wanted in zip(found, alone, strict=True):  # outputs, flags, states
                assert (ours[:, k] == wanted).all()
        assert (found[0][0] != found[0][-1]).any()
        many.reset()
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 3, \d+\), not "):
        many.update(words[0])
