"""Compile an emitted program for this computer and run it through ctypes."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.firmware.emit import Body, emit_c, preamble
from boresight.model.arrays import BoolArray
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed, failure
from boresight.model.tools.files import Cache
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Kind, Op, Overflow, Program

_HOST = """\
#include "@name@.c"

#include <stddef.h>
#include <string.h>

// Bytes of an estimator.
size_t @name@_size(void) {
    return sizeof(@name@_t);
}

// Runs updates of several estimators: inputs[updates][runs][] -> outputs[updates][runs][],
// flags[updates][runs], and, unless it is NULL, states[updates][runs][]: the words after each
// update. Each structure begins with consecutive numbers.
void @name@_run(@name@_t *const all, const size_t runs, const size_t updates,
    const @number@ *inputs, @number@ *outputs, unsigned char *flags, @number@ *states) {
    @name@_in_t in = {0};
    @name@_out_t out;
    for (size_t k = 0u; k < updates; k++) {
        for (size_t j = 0u; j < runs; j++) {
            memcpy(&in, inputs, @macro@_INPUTS * sizeof *inputs);
            @name@_update(&all[j], &in, &out);
            memcpy(outputs, &out, @macro@_OUTPUTS * sizeof *outputs);
            inputs += @macro@_INPUTS;
            outputs += @macro@_OUTPUTS;
            *flags++ = (unsigned char) (@flags@);
            if (states != NULL) {
                memcpy(states, &all[j].state, @states@u * sizeof *states);
                states += @states@u;
            }
        }
    }
}
"""
_OBSERVE = """\
#include "@name@.h"

#include <stddef.h>
#include <string.h>

@preamble@

// Runs updates: inputs[updates][]. For each value: narrows low and high to its least and largest
// word (of states: before the update), with the update that first had it; counts saturations.
void @name@_observe(@name@_t *const self, const size_t updates, const int32_t *inputs,
    int32_t *const low, int32_t *const high, int64_t *const low_at, int64_t *const high_at,
    int64_t *const saturations) {
    const size_t values = @values@u;
    int32_t words[@values@ + 1];
    @name@_in_t row = {0};
    const @name@_in_t *const in = &row;
    (void) self;
    (void) in;
    (void) saturations;
    for (size_t k = 0u; k < updates; k++) {
        memcpy(&row, inputs, @macro@_INPUTS * sizeof *inputs);
        inputs += @macro@_INPUTS;
        @update@
        for (size_t v = 0u; v < values; v++) {
            if (words[v] < low[v]) {
                low[v] = words[v];
                low_at[v] = (int64_t) k;
            }
            if (words[v] > high[v]) {
                high[v] = words[v];
                high_at[v] = (int64_t) k;
            }
        }
    }
}
"""


def _filled(template: str, **texts: object) -> str:
    for key, text in texts.items():
        template = template.replace(f"@{key}@", str(text))
    return template


def host_source(name: str, states: int, *, number: str = "int32_t") -> str:
    """Text of ``<name>_host.c``, of a program or, with another ``number``, in floating point."""
    flags = "(out.saturated ? 1u : 0u) | (out.beyond ? 2u : 0u)" if number == "int32_t" else "0u"
    texts = {"name": name, "macro": name.upper(), "number": number, "states": states}
    return _filled(_HOST, **texts, flags=flags)


def observe_source(body: Body) -> str:
    """Text of ``<name>_observe.c``, which needs only ``<name>.h``."""

    def count(op: Op) -> list[str]:
        if op.overflow is not Overflow.SAT:
            return []
        return [f"saturations[{op.dest}] += saturated ? 1 : 0;", "saturated = false;"]

    values = range(len(body.program.values))
    words = [f"words[{n}] = {body.word(n)};" for n in values]
    unused = ["(void) saturated;", "(void) beyond;"]
    update = "\n".join(body.statements(after=[*words, *unused], every_word=True, behind=count))
    return _filled(
        _OBSERVE,
        preamble="\n\n".join(filter(None, preamble(body, update))),
        update=update.replace("\n", "\n        "),
        name=body.name,
        macro=body.name.upper(),
        values=len(values),
    )


#: Flags for speed; others are fixed. More optimisation doubles the time to compile for little gain.
CFLAGS = ("-O1",)

#: Without fused multiply-add, which some compilers use by default: the same bits everywhere.
_FIXED_FLAGS = ("-std=c99", "-shared", "-fPIC", "-ffp-contract=off")


def find_compiler() -> str:
    """Path of ``gcc``, else of ``cc``; raises `ToolMissing` without either."""
    if path := shutil.which("gcc") or shutil.which("cc"):
        return path
    raise ToolMissing(
        "no C compiler was found: install gcc (Debian, Ubuntu: apt install gcc) or put cc on the "
        "PATH."
    )


@functools.cache
def _version(compiler: str) -> bytes:
    return subprocess.run([compiler, "--version"], check=True, capture_output=True).stdout


def compiled_library(
    files: Mapping[str, str], *, libraries: Sequence[str] = (), cache: Path | None = None
) -> Path:
    """Return the shared library of C99 files, from the build cache, which holds the sources too.

    ``files`` has ``<name>.h`` first; the last one is compiled and includes the others. ``cache`` is
    the folder of the cache, by default that of the user.
    """
    name, source = next(iter(files)).removesuffix(".h"), [*files][-1]
    compiler = find_compiler()
    flags = [*_FIXED_FLAGS, *CFLAGS]
    identity = repr([compiler, _version(compiler), name, source, flags, libraries, dict(files)])

    def make(folder: Path) -> None:
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [compiler, *flags, source, "-o", f"{name}.so", *libraries]
        completed = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if completed.returncode != 0:
            raise ToolFailed(failure(f"{' '.join(command)} failed", completed.stderr))

    return Cache(cache).get(name, identity, make) / f"{name}.so"


class HostModel:
    """Estimators of a compiled library, one behind the other in memory.

    ``library`` has ``<stem>_size``, ``_init``, ``_reset`` and ``_run`` (`firmware.build`), with
    words of the type ``number``. The attributes ``params`` and ``states``, (runs, words), are the
    estimators' memory itself.
    """

    def __init__(
        self, library: Path, number: npt.DTypeLike, params: int, states: int, runs: int = 1
    ) -> None:
        self.library, self._loaded = library, ctypes.CDLL(str(library))
        size = self.function("size")
        size.restype = ctypes.c_size_t
        self._memory = np.zeros((runs, size() // np.dtype(number).itemsize), number)
        self.params = self._memory[:, :params]
        self.states = self._memory[:, max(1, params) :][:, :states]  # a structure has a member
        for row in self._memory:
            self.function("init")(ctypes.c_void_p(row.ctypes.data))

    def function(self, name: str) -> Any:
        function = getattr(self._loaded, f"{self.library.stem}_{name}")
        function.restype = None
        return function

    def reset(self) -> None:
        """Set the states to their first words; parameters stay as they are."""
        for row in self._memory:
            self.function("reset")(ctypes.c_void_p(row.ctypes.data))

    def records(self, inputs: npt.ArrayLike, *shape: int) -> npt.NDArray[Any]:
        """The inputs (n, ``*shape``) as the library reads them; ValueError for another shape."""
        words = np.ascontiguousarray(inputs, self._memory.dtype)
        if words.shape[1:] != shape:
            wanted = ", ".join(map(str, ("n", *shape)))
            raise ValueError(f"inputs must have shape ({wanted}), not {words.shape}")
        return words

    def run(
        self, records: npt.NDArray[Any], outputs: int, *, traced: bool = False
    ) -> tuple[npt.NDArray[Any], npt.NDArray[np.uint8], npt.NDArray[Any] | None]:
        """Updates: records (n, runs, n_inputs) -> outputs, flags (n, runs), states if ``traced``.

        All arrays are C-contiguous.
        """
        count, runs = records.shape[:2]
        out = np.empty((count, runs, outputs), records.dtype)
        flags = np.empty((count, runs), np.uint8)
        states = np.empty((count, *self.states.shape), records.dtype) if traced else None
        self.function("run")(
            _pointer(self._memory),
            *map(ctypes.c_size_t, (runs, count)),
            *map(_pointer, (records, out, flags, states)),
        )
        return out, flags, states


def _pointer(array: npt.NDArray[Any] | None) -> ctypes.c_void_p:
    return ctypes.c_void_p(None if array is None else array.ctypes.data)


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


class CModel(HostModel):
    """The emitted C of a program, as a host model: same words as the interpreter, much faster.

    Objects are independent of each other; an object must not be used by several threads at once.
    With ``runs``, so many run side by side, with parameters and states of their own; arrays then
    have the shape (n, runs, ...) in place of (n, ...). ``files`` are the program's by name, by
    default those of `emit_c`. ``beyond``, bool (n,), says whether an input of each update of the
    last call was beyond its declared range.
    """

    def __init__(
        self, program: Program, runs: int | None = None, *, files: Mapping[str, str] | None = None
    ) -> None:
        self.program, self._runs = program, () if runs is None else (runs,)
        self._names = [program.values[n].name for n in program.of_kind(Kind.PARAM)]
        self._files = dict(files or emit_c(program))
        name, states = next(iter(self._files)).removesuffix(".h"), len(program.states)
        host = {**self._files, f"{name}_host.c": host_source(name, states)}
        library = compiled_library(host)
        super().__init__(library, np.int32, len(self._names), states, runs or 1)
        self.beyond: BoolArray = np.zeros(0, dtype=np.bool_)

    def _checked(self, words: npt.ArrayLike, subject: str) -> npt.NDArray[np.int32]:
        """Words as int32; ValueError if one does not fit."""
        array = np.asarray(words)
        if array.size and array.dtype.kind not in "iu":
            raise ValueError(f"{subject} must be integers, not {array.dtype}")
        arith = self.program.arithmetic
        fits = array.dtype == np.int32 and arith.word == 32
        if array.size and not fits and (array.min() < arith.min_int or array.max() > arith.max_int):
            raise ValueError(f"{subject} must fit {arith.word} bits")
        return array.astype(np.int32, copy=False)

    def _records(self, inputs: npt.ArrayLike) -> npt.NDArray[np.int32]:
        words = self._checked(inputs, "inputs")
        return self.records(words, *self._runs, len(self.program.inputs))

    def set_param(self, name: str, word: int) -> None:
        """Write a parameter, by the name of its value; ValueError if it or the word is none."""
        if name not in self._names:
            names = ", ".join(self._names) or "none"
            raise ValueError(f"name must be a parameter ({names}), not {name!r}")
        self.params[:, self._names.index(name)] = self._checked([word], "word")[0]

    def update(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray]:
        """Run n updates of input words int (n, n_inputs), in stream order.

        Returns output words int64 (n, n_outputs), and whether a `SAT` operation of the update
        clamped its result, bool (n,). Raises ValueError for a wrong shape or a word that does not
        fit.
        """
        return self._updates(inputs)[:2]

    def trajectory(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray, IntArray]:
        """As `update`, and the state words int64 (n, n_states) after each update."""
        return self._updates(inputs, traced=True)

    def _updates(
        self, inputs: npt.ArrayLike, *, traced: bool = False
    ) -> tuple[IntArray, BoolArray, IntArray]:
        words = self._records(inputs)
        shape = words.shape[:-1]
        records = words.reshape(len(words), *self._memory.shape[:1], words.shape[-1])
        outputs, flags, states = self.run(records, len(self.program.outputs), traced=traced)
        flags = flags.reshape(shape)
        self.beyond = flags > 1
        # Each output's words side by side in memory, as they are used.
        out = outputs.reshape(*shape, outputs.shape[-1]).astype(np.int64, order="F")
        after = np.empty(0) if states is None else states.reshape(*shape, states.shape[-1])
        return out, (flags & 1).view(np.bool_), after.astype(np.int64)

    @functools.cached_property
    def _observe(self) -> Any:
        """Function of a second library that works on the same states."""
        stem = self.library.stem
        files = {f"{stem}.h": self._files[f"{stem}.h"]}
        files[f"{stem}_observe.c"] = observe_source(Body(self.program))
        library = compiled_library(files)
        return getattr(ctypes.CDLL(str(library)), f"{stem}_observe")

    def observe(self, inputs: npt.ArrayLike) -> WordRanges:
        """Run n updates, at least one, as `update`, and return the extremes of every value.

        States count with the words before each update.
        """
        words = self._records(inputs)
        if not len(words):
            raise ValueError("inputs must have at least one row")
        count, limit = len(self.program.values), np.iinfo(np.int32)
        low, high = (np.full(count, end, np.int32) for end in (limit.max, limit.min))
        at = np.zeros((3, count), dtype=np.int64)  # low_at, high_at, saturations
        arrays = map(_pointer, (words, low, high, *at))
        self._observe(_pointer(self._memory), ctypes.c_size_t(len(words)), *arrays)
        return WordRanges(low.astype(np.int64), high.astype(np.int64), *at)
