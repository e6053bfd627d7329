"""Every estimator on every log: ours in float and in fixed point, and the published ones.

Fixed point is the C model, whose words are those of the core. All logs of similar length go
through the float reference side by side: shorter ones are padded with their last row, and what the
padding gave is cut off again.

Work is spread over processes (`spawn`: a script that calls `benchmark` with more than one needs
``if __name__ == "__main__"``).
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of as find_estimator
from boresight.sim.accuracy.peers import PEERS, dip_rad, peer, require_peers, run_peer
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.attitude.accuracy import AttitudeRmse, attitude_rmse, largest_turn_deg
from boresight.sim.attitude.feed import attitude_of, inputs_of, named_outputs, status_of
from boresight.sim.attitude.log import Log

__all__ = ["Result", "Trial", "VsFloat", "batches", "benchmark", "run_float_batch"]

FloatArray = npt.NDArray[np.float64]
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Trial:
    """A log, and the attitude its figures are measured against.

    ``reference``: "truth"; "comparison" (another device's estimate, in the log); or the name of
    the peer whose estimate it is. Only truth enters means. ``folder``: where the log is from.
    """

    log: Log
    reference: str
    q: FloatArray
    folder: str = ""

    def rmse(self, q: FloatArray) -> AttitudeRmse:
        """Error of attitudes (n, 4) in the samples that count; norm zero counts as NaN."""
        return attitude_rmse(
            np.where(q.any(axis=1, keepdims=True), q, np.nan), self.q, self.log.mov
        )


@dataclass(frozen=True)
class VsFloat:
    """Fixed point against float64 on one log, every sample.

    ``max_deg``: largest angle between the attitudes; ``status_changed``: samples whose status
    words differ, so gate decisions too.
    """

    max_deg: float
    status_changed: int


@dataclass(frozen=True)
class Result:
    """One estimator, at one level, on one log.

    ``level``: "fixed", "float", or "package" for a peer. ``seconds``: time of the run; logs that
    ran side by side share it by samples. ``saturated``: updates in which an operation saturated;
    that and ``vs_float`` belong to fixed point.
    """

    estimator: str
    level: str
    trial: str
    rmse: AttitudeRmse
    seconds: float
    saturated: int | None = None
    vs_float: VsFloat | None = None


def batches(lengths: Sequence[int]) -> list[list[int]]:
    """Indices of logs that run side by side: none is shorter than half the longest of its batch."""
    out: list[list[int]] = []
    for index in sorted(range(len(lengths)), key=lambda k: (-lengths[k], k)):
        if out and 2 * lengths[index] >= lengths[out[-1][0]]:
            out[-1].append(index)
        else:
            out.append([index])
    return out


def run_float_batch(
    estimator: Estimator, inputs: Sequence[FloatArray], params: Mapping[str, float] | None = None
) -> list[dict[str, FloatArray]]:
    """Float outputs (n,) by name of every log, all logs side by side.

    Parameters
    ----------
    inputs : sequence of (n, n_inputs) arrays
        Of any lengths n; shorter ones are padded at the end with their last row.
    """
    longest = max(map(len, inputs))
    padded = np.stack(
        [np.concatenate([x, np.repeat(x[-1:], longest - len(x), axis=0)]) for x in inputs], axis=-1
    )
    outputs = estimator.run_float(padded, params=params).outputs
    return [
        {name: y[: len(x), k].copy() for name, y in outputs.items()} for k, x in enumerate(inputs)
    ]


def _ours(
    name: str,
    trials: Sequence[Trial],
    params: Mapping[str, float] | None,
    word: int,
    with_float: bool,
) -> list[Result]:
    """One of our estimators on all logs."""
    estimator = find_estimator(name)
    start = time.perf_counter()
    scorer = Scorer(estimator, [t.log for t in trials], word=word, jobs=1)
    runs = scorer.runs(params)
    fixed = [named_outputs(scorer.program, run.outputs) for run in runs]
    pace = (time.perf_counter() - start) / sum(len(t.log) for t in trials)
    out = []
    against: list[VsFloat | None] = [None] * len(trials)
    if with_float:
        inputs = [inputs_of(estimator, t.log) for t in trials]
        for batch in batches([len(x) for x in inputs]):
            start = time.perf_counter()
            floating = run_float_batch(estimator, [inputs[k] for k in batch], params)
            float_pace = (time.perf_counter() - start) / sum(len(inputs[k]) for k in batch)
            for k, outputs in zip(batch, floating, strict=True):
                changed = 0
                if "status" in outputs:
                    changed = int(np.count_nonzero(status_of(outputs) != status_of(fixed[k])))
                turn = largest_turn_deg(attitude_of(fixed[k]), attitude_of(outputs))
                against[k] = VsFloat(turn, changed)
                out.append(
                    Result(
                        name,
                        "float",
                        trials[k].log.name,
                        trials[k].rmse(attitude_of(outputs)),
                        float_pace * len(inputs[k]),
                    )
                )
    return [
        Result(
            name,
            "fixed",
            t.log.name,
            t.rmse(attitude_of(f)),
            pace * len(t.log),
            int(np.count_nonzero(run.saturated)),
            a,
        )
        for t, f, run, a in zip(trials, fixed, runs, against, strict=True)
    ] + out


def _dips(trials: Sequence[Trial]) -> dict[str, float]:
    """Dip of the field [rad] by folder, as of one place: the median over its logs.

    A single log's own dip carries the errors of its sensors' calibration (2 to 3 degrees).
    """
    dips: dict[str, list[float]] = {}
    for t in trials:
        if t.log.mag_new.any():
            dips.setdefault(t.folder, []).append(dip_rad(t.log))
    return {folder: float(np.median(values)) for folder, values in dips.items()}


def _peer(name: str, trials: Sequence[Trial], dips: Mapping[str, float]) -> list[Result]:
    """One peer on some logs."""
    out = []
    for trial in trials:
        start = time.perf_counter()
        q = run_peer(peer(name), trial.log, dips.get(trial.folder))
        out.append(
            Result(name, "package", trial.log.name, trial.rmse(q), time.perf_counter() - start)
        )
    return out


def _done(
    jobs: int, tasks: Sequence[tuple[str, Callable[..., list[Result]], tuple[object, ...]]]
) -> Iterator[tuple[str, list[Result]]]:
    """Results of the tasks (label, function, arguments), as they come."""
    if jobs == 1:
        for label, work, arguments in tasks:
            yield label, work(*arguments)
        return
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=context) as pool:
        with _uninterrupted():
            labels: dict[Future[list[Result]], str] = {
                pool.submit(work, *arguments): label for label, work, arguments in tasks
            }
        try:
            for future in as_completed(labels):
                yield labels[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Processes that begin meanwhile do not hear Ctrl-C: who began them ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)


def benchmark(
    estimators: Sequence[str],
    peers: Sequence[str],
    trials: Sequence[Trial],
    *,
    params: Mapping[str, Mapping[str, float]] | None = None,
    word: int = 32,
    with_float: bool = True,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> list[Result]:
    """Run everything.

    Parameters
    ----------
    estimators : sequence of str
        Ours, by name.
    peers : sequence of str
        Keys of `sim.accuracy.peers.PEERS`.
    params : mapping, optional
        Parameter values of our estimators, by estimator.
    with_float : bool
        Also run the float reference.
    jobs : int, optional
        Processes; by default one for each processor.

    Returns
    -------
    list of Result
        Ours in the order given, fixed before float, then the peers; each in the order of the
        trials.

    Raises
    ------
    InputError
        Unknown names, an illegal parameter.
    ToolMissing
        A peer's package is not here.
    """
    say = progress or (lambda text: None)
    given = params or {}
    for name in estimators:
        find_estimator(name).param_values(given.get(name))
    require_peers([peer(name) for name in peers])
    dips = _dips(trials)
    # Long ones first, so that no process is left with one at the end.
    tasks: list[tuple[str, Callable[..., list[Result]], tuple[object, ...]]] = [
        (name, _ours, (name, trials, given.get(name), word, with_float)) for name in estimators
    ]
    tasks += [
        (f"{name} on {t.log.name}", _peer, (name, [t], dips))
        for name in peers
        if PEERS[name].slow
        for t in sorted(trials, key=lambda t: -len(t.log))
    ]
    tasks += [(name, _peer, (name, trials, dips)) for name in peers if not PEERS[name].slow]
    out: list[Result] = []
    longest = max(len(t.log) for t in trials)
    if with_float and estimators:
        say(
            f"{len(tasks)} runs; the float reference makes {longest:,} steps over {len(trials)} "
            "logs side by side, up to some minutes for each estimator"
        )
    for k, (label, results) in enumerate(_done(jobs or os.cpu_count() or 1, tasks)):
        out += results
        say(f"[{k + 1}/{len(tasks)}] {label}, {sum(r.seconds for r in results):.1f} s")
    rank = {name: k for k, name in enumerate([*estimators, *peers])}
    place = {t.log.name: k for k, t in enumerate(trials)}
    return sorted(out, key=lambda r: (rank[r.estimator], r.level == "float", place[r.trial]))
