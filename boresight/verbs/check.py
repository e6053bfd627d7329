"""`boresight check`: prove all levels equal on one or more logs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimators import estimator as find_estimator
from boresight.sharing import estimator_names, params_of_each
from boresight.sim.check import CheckResult
from boresight.sim.check import check as check_log
from boresight.sim.check_shared import check_shared, shared_core
from boresight.sim.log import read_log

__all__ = ["check", "log_files"]


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Logs named by paths; a folder stands for every .csv and .npz below it.

    Raises
    ------
    InputError
        A folder without logs.
    """
    out: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            found = sorted(p for p in path.rglob("*") if p.suffix in (".csv", ".npz"))
            if not found:
                raise InputError.at(
                    str(path),
                    wanted="a log, or a folder with .csv or .npz logs",
                    found="a folder without any",
                    fix="name a log file",
                )
            out += found
        else:
            out.append(path)
    return out


def check(
    name: str,
    *logs: str | Path,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    levels: Sequence[str] = ("fixed", "c", "rtl"),
    simulator: str | None = None,
    params: Mapping[str, Any] | None = None,
    reproducer: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
    each: Callable[[CheckResult], None] | None = None,
) -> list[CheckResult]:
    """Check an estimator on logs; see `sim.check.check`.

    ``name`` may be several names with commas: then one core holds them all and they take turns
    (`sim.check_shared.check_shared`); ``params`` is then a mapping by estimator. ``each`` is called
    with every result as soon as it is there.

    Raises
    ------
    InputError
        Unknown names, bad logs. All logs are read before the first is checked.
    """
    names = estimator_names(name)
    estimators = [find_estimator(n) for n in names]
    chosen = params_of_each(names, params)
    read = [read_log(path) for path in log_files(logs)]
    if not read:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    results = []
    core = None
    for log in read:
        say = None if progress is None else (lambda text, log=log: progress(f"{log.name}: {text}"))
        if len(names) > 1:
            if core is None and "rtl" in levels:
                core = shared_core(estimators, config=config, word=word, params=chosen)
            found = check_shared(
                estimators,
                log,
                config=config,
                word=word,
                steps=steps,
                levels=levels,
                simulator=simulator,
                params=chosen,
                core=core,
                progress=say,
            )
        else:
            found = [
                check_log(
                    estimators[0],
                    log,
                    config=config,
                    word=word,
                    steps=steps,
                    levels=levels,
                    simulator=simulator,
                    params=chosen[0],
                    reproducer=None if reproducer is None else Path(reproducer),
                    progress=say,
                )
            ]
        results += found
        if each is not None:
            for result in found:
                each(result)
    return results
