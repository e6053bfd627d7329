"""Error of an estimator's C model over many logs, again and again with other parameters.

What does not depend on the parameters is done once: the program is compiled, its C built, the
input words of every log prepared. Threads share the logs; each has a C model of its own, whose
calls leave Python's lock, so that they run side by side.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, input_words, param_words
from boresight.model.words.fixed import IntArray
from boresight.sim.attitude.accuracy import AttitudeRmse, attitude_rmse
from boresight.sim.attitude.feed import attitude_of, inputs_of, named_outputs
from boresight.sim.attitude.log import Log

__all__ = ["CRun", "Scorer", "has_truth"]

_T = TypeVar("_T")


def _counting(log: Log) -> npt.NDArray[np.bool_]:
    """Samples (n,) that count in an error: with reference, and moving."""
    if log.q is None:
        return np.zeros(len(log), dtype=np.bool_)
    counts = np.ones(len(log), dtype=np.bool_) if log.mov is None else log.mov.copy()
    counts[np.isnan(log.q).any(axis=1)] = False
    return counts


def has_truth(log: Log) -> bool:
    """Whether a log has a reference attitude in a sample that counts."""
    return bool(_counting(log).any())


class CRun(NamedTuple):
    """Output words (n, n_outputs) and saturation flags (n,) of one log."""

    outputs: IntArray
    saturated: npt.NDArray[np.bool_]


class Scorer:
    """The C model of one estimator over fixed logs.

    Parameters
    ----------
    estimator : Estimator
        With outputs ``qw qx qy qz``.
    logs : sequence of Log
    word : int
        Word width, 18 to 32.
    jobs : int, optional
        Threads; by default one for each processor.

    Raises
    ------
    InputError
        No attitude among the outputs, or an input that logs do not have.
    """

    def __init__(
        self, estimator: Estimator, logs: Sequence[Log], *, word: int = 32, jobs: int | None = None
    ) -> None:
        if not {"qw", "qx", "qy", "qz"} <= {o.name for o in estimator.outputs}:
            raise InputError.at(
                estimator.name,
                wanted="outputs qw, qx, qy, qz",
                found="others",
                fix="only the error of an attitude can be measured",
            )
        self.estimator = estimator
        self.logs = tuple(logs)
        self.program = estimator.compile(word=word)
        self._words = [
            np.ascontiguousarray(
                input_words(self.program, inputs_of(estimator, log)[:, :, None])[:, :, 0],
                dtype=np.int32,
            )
            for log in self.logs
        ]
        self._rows = [np.flatnonzero(_counting(log)) for log in self.logs]
        self.jobs = max(1, min(jobs or os.cpu_count() or 1, len(self.logs)))
        self._models: SimpleQueue[CModel] = SimpleQueue()
        for _ in range(self.jobs):
            self._models.put(CModel(self.program))

    def _each(
        self,
        which: Sequence[int],
        params: Mapping[str, float] | None,
        work: Callable[[int, CRun], _T],
    ) -> list[_T]:
        """``work`` on the run of every log in ``which``, in that order."""
        words = param_words(self.program, self.estimator.param_values(params))

        def one(index: int) -> _T:
            model = self._models.get()
            try:
                for value, word in words.items():
                    model.set_param(self.program.values[value].name, word)
                model.reset()
                return work(index, CRun(*model.update(self._words[index])))
            finally:
                self._models.put(model)

        if self.jobs == 1:
            return [one(index) for index in which]
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(one, which))

    def runs(self, params: Mapping[str, float] | None = None) -> list[CRun]:
        """Run every log with these parameters (defaults for those not named)."""
        return self._each(range(len(self.logs)), params, lambda _, run: run)

    def scores(
        self, params: Mapping[str, float] | None = None, which: Sequence[int] | None = None
    ) -> list[AttitudeRmse]:
        """RMSE [deg] of some logs (all by default), in the order of ``which``.

        An attitude of norm zero counts as NaN: the figure of that log is NaN.

        Raises
        ------
        InputError
            Unknown or illegal parameter; a log without truth.
        """

        def score(index: int, run: CRun) -> AttitudeRmse:
            log, rows = self.logs[index], self._rows[index]
            if log.q is None or not len(rows):
                raise InputError.at(
                    f"log {log.name!r}",
                    wanted="a reference attitude",
                    found="none",
                    fix="leave this log out",
                )
            q = attitude_of(named_outputs(self.program, run.outputs[rows]))
            q[~q.any(axis=1)] = np.nan
            return attitude_rmse(q, log.q[rows])

        return self._each(range(len(self.logs)) if which is None else which, params, score)
