"""Compile an emitted program for this computer and run it through ctypes."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.firmware.body import Body
from boresight.firmware.emit import emit_c, preamble
from boresight.firmware.host import load
from boresight.firmware.layout import END, banner, block, join
from boresight.model.arrays import BoolArray
from boresight.model.errors import ToolMissing
from boresight.model.tools.cache import Cache
from boresight.model.tools.failure import ToolFailed, failure
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Op, Overflow, Program

#: Flags for speed; others are fixed. More optimisation doubles the time to compile for little gain.
CFLAGS = ("-O1",)

#: Without fused multiply-add, which some compilers use by default: the same bits everywhere.
_FIXED_FLAGS = ("-std=c99", "-shared", "-fPIC", "-ffp-contract=off")


def find_compiler() -> str:
    """Path of ``gcc``, else of ``cc``; raises `ToolMissing` without either."""
    path = shutil.which("gcc") or shutil.which("cc")
    if path is None:
        raise ToolMissing(
            "no C compiler was found: install gcc (Debian, Ubuntu: "
            "apt install gcc) or put cc on the PATH."
        )
    return path


@functools.cache
def _version(compiler: str) -> str:
    return subprocess.run(
        [compiler, "--version"], check=True, capture_output=True, text=True
    ).stdout


def compiled_library(
    files: Mapping[str, str],
    *,
    source: str = "",
    cflags: Sequence[str] | None = None,
    libraries: Sequence[str] = (),
    cache: Path | None = None,
) -> Path:
    """Return the shared library of C99 files, from the build cache or compiled.

    The entry of the cache holds its sources too; its name is the hash of the sources, the compiler
    and the flags.

    Parameters
    ----------
    files : mapping of str to str
        ``<name>.h`` first.
    source : str
        The file that is compiled and includes the others; ``<name>_host.c`` by default.
    cflags : sequence of str, optional
        Flags beside those that make a shared library of C99; `CFLAGS` by default.
    libraries : sequence of str
        Libraries to link.
    cache : Path or None
        Folder of the cache; None: that of the user.

    Raises
    ------
    ToolMissing
        No C compiler is installed.
    """
    name = next(iter(files)).removesuffix(".h")
    source = source or f"{name}_host.c"
    compiler = find_compiler()
    flags = [*_FIXED_FLAGS, *(CFLAGS if cflags is None else cflags)]
    identity = repr([compiler, _version(compiler), name, source, flags, libraries, dict(files)])

    def make(folder: Path) -> None:
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [compiler, *flags, source, "-o", f"{name}.so", *libraries]
        completed = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if completed.returncode != 0:
            raise ToolFailed(failure(f"{' '.join(command)} failed", completed.stderr))

    return Cache(cache).get(name, identity, make) / f"{name}.so"


def instance(
    library: Path, runs: int = 1, **arguments: Sequence[Any]
) -> tuple[Any, dict[str, Callable[..., None]]]:
    """Estimators of a compiled library, initialised: their memory, the functions by name.

    Parameters
    ----------
    library : Path
        Library with functions ``STEM_NAME``, whose first argument is the (first) estimator.
    runs : int
        Number of estimators, one behind the other in memory.
    **arguments
        Types of the other arguments, by name of the function; `array_of` for arrays.
    """
    loaded = ctypes.CDLL(str(library))
    size = getattr(loaded, f"{library.stem}_size")
    size.argtypes, size.restype = [], ctypes.c_size_t
    memory = ctypes.create_string_buffer(runs * size())
    functions: dict[str, Callable[..., None]] = {}
    for name, types in {"init": (), "reset": (), **arguments}.items():
        function = getattr(loaded, f"{library.stem}_{name}")
        function.argtypes, function.restype = [ctypes.c_void_p, *types], None
        functions[name] = functools.partial(function, memory)
    functions["init"]()
    memory.raw = memory.raw[: size()] * runs
    return memory, functions


def array_of(kind: npt.DTypeLike) -> Any:
    """Type of an argument that is an array."""
    return np.ctypeslib.ndpointer(kind, flags="C_CONTIGUOUS")


class WordRanges(NamedTuple):
    """Result of `CModel.observe`: int64 arrays by value number.

    ``low_at``/``high_at``: the first update with the least and with the largest word.
    ``saturations``: updates in which the value's `SAT` operation clamped it.
    """

    low: IntArray
    high: IntArray
    low_at: IntArray
    high_at: IntArray
    saturations: IntArray

    def followed(self, updates: int, other: WordRanges) -> WordRanges:
        """Of these and more updates: ``updates`` are these, ``other`` of those that follow."""
        lower, higher = other.low < self.low, other.high > self.high
        return WordRanges(
            np.where(lower, other.low, self.low),
            np.where(higher, other.high, self.high),
            np.where(lower, updates + other.low_at, self.low_at),
            np.where(higher, updates + other.high_at, self.high_at),
            self.saturations + other.saturations,
        )


class CModel:
    """The emitted C of a program, as a host model: same words as the interpreter, much faster.

    Objects are independent of each other; an object must not be used by several threads at once.

    Parameters
    ----------
    program : Program
        Program to run.
    cflags, cache
        See `compiled_library`.
    files : mapping of str to str, optional
        Contents of the program's files by name; by default those of `emit_c`.

    Attributes
    ----------
    library : Path
        The compiled library, with its sources beside it.
    beyond : bool (n,)
        Whether an input of each update of the last call was beyond its declared range.
    """

    def __init__(
        self,
        program: Program,
        *,
        cflags: Sequence[str] | None = None,
        cache: Path | None = None,
        files: Mapping[str, str] | None = None,
    ) -> None:
        self.program = program
        self.cflags = tuple(CFLAGS if cflags is None else cflags)
        self._params = {program.values[n].name: n for n in program.of_kind(Kind.PARAM)}
        count, word = ctypes.c_size_t, ctypes.c_int32
        words = array_of(np.int32)
        self._files, self._cache = files or emit_c(program), cache
        self.library = compiled_library(self._files, cflags=self.cflags, cache=cache)
        self.beyond: BoolArray = np.zeros(0, dtype=np.bool_)
        self._memory, self._call = instance(
            self.library,
            set_param=(count, word),
            run=(count, words, words, array_of(np.uint8), ctypes.c_void_p),
        )

    @property
    def states(self) -> npt.NDArray[np.int32]:
        """Words of the states, (n_states,): the estimator's memory itself."""
        states = np.frombuffer(self._memory, np.int32)[max(1, len(self._params)) :]
        return states[: len(self.program.states)]

    @functools.cached_property
    def _observe(self) -> Callable[..., None]:
        """Function of a second library that works on the same states."""
        header = next(iter(self._files))
        source = f"{self.library.stem}_observe.c"
        files = {header: self._files[header], source: observe_source(Body(self.program))}
        words, numbers = array_of(np.int32), array_of(np.int64)
        library = compiled_library(files, source=source, cflags=self.cflags, cache=self._cache)
        function = getattr(ctypes.CDLL(str(library)), f"{library.stem}_observe")
        function.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *3 * (words,), *3 * (numbers,)]
        function.restype = None
        return functools.partial(function, self._memory)

    def _checked(self, words: npt.ArrayLike, subject: str) -> npt.NDArray[np.int32]:
        """Words as contiguous int32; ValueError if one does not fit."""
        array = np.asarray(words)
        if array.size and array.dtype.kind not in "iu":
            raise ValueError(f"{subject} must be integers, not {array.dtype}")
        arith = self.program.arithmetic
        fits = array.dtype == np.int32 and arith.word == 32
        if array.size and not fits and (array.min() < arith.min_int or array.max() > arith.max_int):
            raise ValueError(f"{subject} must fit {arith.word} bits")
        return np.ascontiguousarray(array, dtype=np.int32)

    def _records(self, inputs: npt.ArrayLike) -> npt.NDArray[np.int32]:
        """Input words (n, n_inputs), checked."""
        words = self._checked(inputs, "inputs")
        n_inputs = len(self.program.inputs)
        if words.ndim != 2 or words.shape[1] != n_inputs:
            raise ValueError(f"inputs must have shape (n, {n_inputs}), not {words.shape}")
        return words

    def reset(self) -> None:
        """Set the states to their reset words; parameters stay as they are."""
        self._call["reset"]()

    def set_param(self, name: str, word: int) -> None:
        """Write a parameter, by the name of its value.

        Raises
        ------
        ValueError
            Unknown parameter, or a word that does not fit.
        """
        if name not in self._params:
            names = ", ".join(self._params) or "none"
            raise ValueError(f"name must be a parameter ({names}), not {name!r}")
        self._call["set_param"](self._params[name], int(self._checked([word], "word")[0]))

    def update(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray]:
        """Run n updates.

        Parameters
        ----------
        inputs : int (n, n_inputs)
            Input words in stream order.

        Returns
        -------
        outputs : int64 (n, n_outputs)
        saturated : bool (n,)
            Whether a `SAT` operation of the update clamped its result.

        Raises
        ------
        ValueError
            The shape is wrong or a word does not fit.
        """
        return self._updates(inputs, None)

    def trajectory(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray, IntArray]:
        """As `update`, and the state words int64 (n, n_states) after each update."""
        states = np.empty((len(np.asarray(inputs)), len(self.program.states)), dtype=np.int32)
        return *self._updates(inputs, states), states.astype(np.int64)

    def _updates(
        self, inputs: npt.ArrayLike, states: npt.NDArray[np.int32] | None
    ) -> tuple[IntArray, BoolArray]:
        words = self._records(inputs)
        outputs = np.empty((len(words), len(self.program.outputs)), dtype=np.int32)
        flags = np.empty(len(words), dtype=np.uint8)
        state_words = None if states is None else states.ctypes
        self._call["run"](len(words), words, outputs, flags, state_words)
        self.beyond = flags > 1
        # Each output's words side by side in memory, as they are used.
        return outputs.astype(np.int64, order="F"), (flags & 1).view(np.bool_)

    def values_of_update(self, inputs: npt.ArrayLike) -> dict[int, int]:
        """Run one update and return all its words by value number.

        The words of states are those before the update (`Interpreter.values_before_commit`).
        Find the first update that differs with `update`, come back to the one before it by
        `reset`, then compare these words in the order of the operations.
        """
        return dict(enumerate(self.observe(np.asarray(inputs)[None]).low.tolist()))

    def observe(self, inputs: npt.ArrayLike) -> WordRanges:
        """Run n updates, at least one, and return the extremes of every value.

        States count with the words before each update. ``inputs`` as in `update`.

        Raises
        ------
        ValueError
            The shape is wrong, there is no update, or a word does not fit.
        """
        words = self._records(inputs)
        if not len(words):
            raise ValueError("inputs must have at least one row")
        count = len(self.program.values)
        limit = np.iinfo(np.int32)
        low = np.full(count, limit.max, dtype=np.int32)
        high = np.full(count, limit.min, dtype=np.int32)
        at = np.zeros((3, count), dtype=np.int64)  # low_at, high_at, saturations
        self._observe(len(words), words, low, high, *at)
        return WordRanges(low.astype(np.int64), high.astype(np.int64), *at)


class ManyCModels:
    """The emitted C of a program for several runs with separate states.

    One call updates all; each gives the words that a `CModel` of its own would. Parameters are
    those of the program.

    Parameters
    ----------
    program : Program
        Program to run.
    runs : int
    cache : Path or None
        See `compiled_library`.

    Attributes
    ----------
    beyond : bool (runs,)
        As `CModel.beyond`, of the last update.
    """

    def __init__(self, program: Program, runs: int, *, cache: Path | None = None) -> None:
        self.program, self.runs = program, runs
        library, words = compiled_library(emit_c(program), cache=cache), array_of(np.int32)
        each = (ctypes.c_size_t, words, words, array_of(np.uint8))
        self._memory, self._call = instance(library, runs, each=each)
        self._first = self._memory.raw
        self.beyond: BoolArray = np.zeros(runs, dtype=np.bool_)

    def reset(self) -> None:
        """Set the states of every run to their reset words."""
        self._memory.raw = self._first

    def update(self, inputs: npt.NDArray[np.int32]) -> tuple[npt.NDArray[np.int32], BoolArray]:
        """One update of every run: inputs (runs, n_inputs) -> outputs (runs, n_outputs), flags.

        Raises
        ------
        ValueError
            The inputs have another shape or type.
        """
        wanted = (self.runs, len(self.program.inputs))
        if inputs.shape != wanted or inputs.dtype != np.int32:
            raise ValueError(f"inputs must be int32 {wanted}, not {inputs.dtype} {inputs.shape}")
        outputs = np.empty((self.runs, len(self.program.outputs)), dtype=np.int32)
        flags = np.empty(self.runs, dtype=np.uint8)
        self._call["each"](self.runs, np.ascontiguousarray(inputs), outputs, flags)
        self.beyond = flags > 1
        return outputs, (flags & 1).astype(np.bool_)


def _observe(body: Body) -> str:
    name, n_in, n = body.name, len(body.program.inputs), len(body.program.values)
    dump = [f"words[{k}] = {body.word(k)}; // {body.describe(k, name=True)}" for k in range(n)]

    def count(op: Op) -> list[str]:
        if op.overflow is not Overflow.SAT:
            return []
        return [f"saturations[{op.dest}] += saturated ? 1 : 0;", "saturated = false;"]

    counters = ("low_at", "high_at", "saturations")
    update = [
        *(line.replace("in.", "row.", 1) for line in load(body, f"k * {n_in}u + ")),
        *body.statements(
            after=[*dump, "(void) saturated;", "(void) beyond;"], every_word=True, behind=count
        ),
    ]
    track = [f"for (size_t v = 0u; v < {n}u; v++) {{"] if n else []
    for end, sign in (("low", "<"), ("high", ">")) if n else ():
        track += [
            f"    if (words[v] {sign} {end}[v]) {{",
            f"        {end}[v] = words[v];",
            f"        {end}_at[v] = (int64_t) k;",
            "    }",
        ]
    track += ["}"] if n else []
    return (
        f"// Runs updates: inputs[n_updates][{n_in}]; for each of the {n} values: narrows low "
        "and high to\n// its least and largest word (of states: before the update), with the "
        "update that first had it,\n// and counts its saturations.\n"
    ) + block(
        f"void {name}_observe({name}_t *const self, const size_t n_updates, "
        "const int32_t *const inputs,\n    int32_t *const low, int32_t *const high, "
        "int64_t *const low_at, int64_t *const high_at,\n    int64_t *const saturations)",
        [
            *(f"(void) {w};" for w in ("self", "inputs", "low", "high", *counters)),
            f"int32_t words[{max(n, 1)}];",
            "(void) words;",
            f"{name}_in_t row = {{0}};",
            f"{name}_in_t *const in = &row;",
            "(void) in;",
            "for (size_t k = 0u; k < n_updates; k++) {",
            *(f"    {line}" if line else "" for line in (*update, *track)),
            "}",
        ],
    )


def observe_source(body: Body) -> str:
    """Text of ``<name>_observe.c``, which needs only ``<name>.h``."""
    name, function = body.name, _observe(body)
    return join(
        body.head("_observe.c", "Every word of an update, for a host."),
        banner("Includes"),
        f'#include "{name}.h"\n\n#include <stddef.h>',
        *preamble(body, function),
        f"void {name}_observe({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *low, int32_t *high, int64_t *low_at, int64_t *high_at,\n"
        "    int64_t *saturations);",
        function,
        END,
    )
