"""`firmware.build`: the compiled C gives the interpreter's words, fast, and is cached safely."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.firmware import build
from boresight.firmware.build import CModel, compiled_library, find_compiler
from boresight.firmware.emit import emit_c
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Op, Overflow, Program, Term, Value
from tests.support.random_program import random_inputs, random_program


@pytest.mark.parametrize("word", [18, 24, 32])
def test_every_option_against_plain_python(
    word: int,
    plain: Any,
    corner: Callable[[int], Program],
    corner_rows: Callable[[int], list[list[int]]],
) -> None:
    program, rows = corner(word), corner_rows(word)
    reference = plain(program)
    want = [reference.update(row) for row in rows]
    model = CModel(program)
    outputs, saturated = model.update(rows)
    np.testing.assert_array_equal(outputs, [outs for outs, _, _ in want])
    np.testing.assert_array_equal(saturated, [flag for _, flag, _ in want])
    assert outputs.dtype == np.int64 and saturated.dtype == np.bool_
    model.reset()
    for row, (_, _, words) in zip(rows, want, strict=True):
        assert dict(enumerate(model.observe([row]).low)) == words


@pytest.mark.parametrize(
    ("overflow", "words"),
    [
        (Overflow.SAT, [131071, 131071, -131072, -131072]),
        (Overflow.CLIP, [131071, 131071, -131072, -131072]),
        (Overflow.WRAP, [131071, -131072, -131072, 131071]),
    ],
)
def test_only_sat_raises_the_flag(overflow: Overflow, words: list[int]) -> None:
    values = tuple(
        Value(name, kind, 17, -1.0, 1.0, "test")
        for name, kind in (("x", Kind.INPUT), ("y", Kind.INPUT), ("z", Kind.OP))
    )
    program = Program(
        "edge",
        Arithmetic(18, guard=8),
        values,
        (Op(2, (Term(0, 1, 0),), overflow),),
        (0, 1),
        (2,),
        ("z",),
        (),
        (),
    )
    # z = floor((x y + 128) / 256): the last word that fits and the first that does not, both ends
    rows = [[131071, 256], [65536, 512], [-131072, 256], [-43691, 768]]
    outputs, saturated = CModel(program).update(rows)
    assert outputs[:, 0].tolist() == words
    assert saturated.tolist() == [overflow is Overflow.SAT and k % 2 == 1 for k in range(4)]


@pytest.mark.parametrize("word", [18, 21, 24, 32])
@pytest.mark.parametrize("seed", range(5))
def test_random_programs_against_interpreter(seed: int, word: int) -> None:
    program = random_program(seed, word=word, n_ops=50)
    rows = np.array(random_inputs(program, seed + 1, 200))
    model, interpreter = CModel(program), Interpreter(program)
    outputs, saturated = interpreter.run(rows[:, :, None])
    got, flags = model.update(rows)
    np.testing.assert_array_equal(got, outputs[:, :, 0])
    np.testing.assert_array_equal(flags, saturated[:, 0])
    model.reset()
    interpreter = Interpreter(program)
    again, flagged, states = model.trajectory(rows[:20])
    np.testing.assert_array_equal(again, got[:20])
    np.testing.assert_array_equal(flagged, flags[:20])
    assert states.shape == (20, len(program.states)) and states.dtype == np.int64
    model.reset()
    for row, after in zip(rows[:20], states, strict=True):
        interpreter.update(row[:, None])
        assert [int(interpreter.values[n][0]) for n, _ in program.states] == after.tolist()
        words = [int(w[0]) for w in interpreter.values_before_commit()]
        assert model.observe([row]).low.tolist() == words


@pytest.mark.parametrize("word", [18, 32])
def test_observed_ranges_against_interpreter(word: int) -> None:
    program = random_program(21, word=word, n_ops=60, n_states=5)
    rows = np.array(random_inputs(program, 3, 150))
    model, interpreter = CModel(program), Interpreter(program)
    every = []
    for row in rows:
        interpreter.update(row[:, None])
        every.append([int(w[0]) for w in interpreter.values_before_commit()])
    words = np.array(every)
    seen = model.observe(rows)
    np.testing.assert_array_equal(seen.low, words.min(axis=0))
    np.testing.assert_array_equal(seen.high, words.max(axis=0))
    np.testing.assert_array_equal(seen.low_at, words.argmin(axis=0))
    np.testing.assert_array_equal(seen.high_at, words.argmax(axis=0))
    np.testing.assert_array_equal(seen.saturations, interpreter.saturations)
    assert seen.saturations.any()
    # It leaves the states as `update` does.
    np.testing.assert_array_equal(
        model.update(rows)[0], interpreter.run(rows[:, :, None])[0][:, :, 0]
    )


def test_updates_in_pieces_and_objects_apart() -> None:
    program = random_program(11, n_states=4)
    rows = np.array(random_inputs(program, 1, 60))
    whole, pieces = CModel(program), CModel(program)
    want = whole.update(rows)[0]
    got = np.concatenate([pieces.update(part)[0] for part in (rows[:1], rows[1:1], rows[1:])])
    np.testing.assert_array_equal(got, want)
    whole.reset()
    np.testing.assert_array_equal(whole.update(rows.astype(np.int32))[0], want)


def test_parameters_survive_reset(corner: Callable[[int], Program]) -> None:
    program = corner(24)
    rows = np.array([[5, 7], [-3, 1 << 20]])
    model, interpreter = CModel(program), Interpreter(program)
    default = model.update(rows)[0]
    model.set_param("gain", -12345)
    model.set_param("bias", 99)
    model.reset()
    interpreter.params[program.find("gain")] = -12345
    interpreter.params[program.find("bias")] = 99
    want = interpreter.run(rows[:, :, None])[0][:, :, 0]
    got = model.update(rows)[0]
    np.testing.assert_array_equal(got, want)
    assert (got != default).any()


def test_odd_names_and_no_values_at_all(odd_names: Program, empty: Program) -> None:
    rows = np.array([[k << 20 for k in range(len(odd_names.inputs))]] * 3)
    want = Interpreter(odd_names).run(rows[:, :, None])[0][:, :, 0]
    np.testing.assert_array_equal(CModel(odd_names).update(rows)[0], want)
    nothing = CModel(empty)
    outputs, saturated = nothing.update(np.empty((4, 0), dtype=np.int64))
    assert outputs.shape == (4, 0) and not saturated.any()
    assert nothing.observe(np.empty((4, 0), dtype=np.int64)).low.shape == (0,)


def test_refusals(corner: Callable[[int], Program]) -> None:
    model = CModel(corner(24))
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 2\), not \(2,\)$"):
        model.update([1, 2])
    with pytest.raises(ValueError, match=r"^inputs must have at least one row$"):
        model.observe(np.empty((0, 2), dtype=np.int64))
    with pytest.raises(ValueError, match=r"^inputs must fit 24 bits$"):
        model.update([[1, 1 << 23]])
    with pytest.raises(ValueError, match=r"^inputs must be integers, not float64$"):
        model.update([[0.5, 1.0]])
    with pytest.raises(ValueError, match=r"^word must fit 24 bits$"):
        model.set_param("gain", -(1 << 23) - 1)
    with pytest.raises(ValueError, match=r"^name must be a parameter \(gain, bias\), not 'x'$"):
        model.set_param("x", 0)


def build_library(program: Program, **options: Any) -> Path:
    return compiled_library(emit_c(program), **options)


def test_cache_is_used_and_keyed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = random_program(2, n_ops=5)
    library = build_library(program, cache=tmp_path)
    other = replace(program, outputs=(0,), output_names=("o",))
    others = {build_library(other, cache=tmp_path)}
    with monkeypatch.context() as patch:
        patch.setattr(build, "CFLAGS", ("-O3",))
        others.add(build_library(program, cache=tmp_path))
    assert len({library, *others}) == 3
    suffixes = sorted(p.suffix for p in library.parent.iterdir())
    assert suffixes == [".c", ".h", ".json", ".so"]
    with monkeypatch.context() as patch:
        patch.setattr("subprocess.run", None)
        assert build_library(program, cache=tmp_path) == library


def test_many_builders_at_once(tmp_path: Path) -> None:
    program = random_program(4, n_ops=20)
    with ThreadPoolExecutor(6) as pool:
        paths = set(pool.map(lambda _: build_library(program, cache=tmp_path), range(6)))
    assert len(paths) == 1
    assert {p for p in tmp_path.iterdir()} == {paths.pop().parent, tmp_path / "locks"}


def test_missing_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ToolMissing, match=r"^no C compiler was found: install gcc \(.*\.$"):
        find_compiler()


def test_compiler_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "CFLAGS", ("-no-such-flag",))
    with pytest.raises(ToolFailed, match=r"failed: gcc: error: .*-no-such-flag.* \(log: .*\)$"):
        build_library(random_program(1, n_ops=2), cache=tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["locks"]


def everything_used(program: Program) -> Program:
    """The program with sums of all results that nothing reads, lest the compiler drop them."""
    read = {value for op in program.ops for value in op.operands()}
    unread = [op.dest for op in program.ops if op.dest not in read]
    values, ops, one = list(program.values), list(program.ops), program.find("one")
    outputs = list(program.outputs)
    for k in range(0, len(unread), 8):
        outputs.append(len(values))
        ops.append(
            Op(len(values), tuple(Term(v, one, 25) for v in unread[k : k + 8]), Overflow.WRAP)
        )
        values.append(Value(f"sum{k}", Kind.OP, 31, -1.0, 1.0, "test"))
    return replace(
        program,
        values=tuple(values),
        ops=tuple(ops),
        outputs=tuple(outputs),
        output_names=tuple(f"o{k}" for k in range(len(outputs))),
    )


def test_a_million_updates_per_second() -> None:
    program = everything_used(random_program(10, n_ops=150, n_inputs=9, n_states=12))
    assert len(program.ops) >= 150
    assert sum(len(op.terms) for op in program.ops) >= 330
    model = CModel(program)
    rows = np.random.default_rng(0).integers(-(2**29), 2**29, (50_000, 9), dtype=np.int32)
    seconds = []
    for _ in range(6):
        start = time.process_time()  # of this process: other work may share the core
        model.update(rows)
        seconds.append(time.process_time() - start)
    assert len(rows) / min(seconds) > 1e6
