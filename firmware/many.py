"""Many runs of one program side by side, for closed loops record by record."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import compiled_library
from boresight.firmware.emit import emit_c
from boresight.model.arrays import BoolArray
from boresight.model.words.program import Program

Words = npt.NDArray[np.int32]


class ManyCModels:
    """The emitted C of a program for several runs with separate states.

    One call updates all; each gives the words that a `build.CModel` of its own would. Parameters
    are those of the program.

    Parameters
    ----------
    program : Program
        Program to run.
    runs : int
    cache : Path or None
        See `build.compiled_library`.

    Attributes
    ----------
    beyond : bool (runs,)
        As `build.CModel.beyond`, of the last update.
    """

    def __init__(self, program: Program, runs: int, *, cache: Path | None = None) -> None:
        self.program, self.runs = program, runs
        path = compiled_library(emit_c(program), cache=cache)
        library, stem = ctypes.CDLL(str(path)), path.stem
        size = getattr(library, f"{stem}_size")
        size.argtypes, size.restype = [], ctypes.c_size_t
        memory = ctypes.create_string_buffer(size())
        start = getattr(library, f"{stem}_init")
        start.argtypes, start.restype = [ctypes.c_void_p], None
        start(memory)
        self._first = memory.raw * runs
        self._memory = ctypes.create_string_buffer(self._first, len(self._first))
        self._each = getattr(library, f"{stem}_each")
        self._each.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *3 * (ctypes.c_void_p,)]
        self._each.restype = None
        self.beyond: BoolArray = np.zeros(runs, dtype=np.bool_)

    def reset(self) -> None:
        """Set the states of every run to their reset words."""
        self._memory.raw = self._first

    def update(self, inputs: Words) -> tuple[Words, BoolArray]:
        """One update of every run.

        Parameters
        ----------
        inputs : int32 (runs, n_inputs)
            Input words in stream order.

        Returns
        -------
        outputs : int32 (runs, n_outputs)
        saturated : bool (runs,)
            Whether a `SAT` operation of the update clamped its result.

        Raises
        ------
        ValueError
            The inputs have another shape or type.
        """
        wanted = (self.runs, len(self.program.inputs))
        if inputs.shape != wanted or inputs.dtype != np.int32:
            raise ValueError(f"inputs must be int32 {wanted}, not {inputs.dtype} {inputs.shape}")
        words = np.ascontiguousarray(inputs)
        outputs = np.empty((self.runs, len(self.program.outputs)), dtype=np.int32)
        flags = np.empty(self.runs, dtype=np.uint8)
        self._each(
            self._memory, self.runs, words.ctypes.data, outputs.ctypes.data, flags.ctypes.data
        )
        self.beyond = flags > 1
        return outputs, (flags & 1).astype(np.bool_)
