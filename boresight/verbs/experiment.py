"""`boresight experiment`: a published experiment in simulation, as a page and as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.output import output_folder
from boresight.sim.experiments import ma2014
from boresight.sim.experiments.ma2014_html import render

__all__ = ["EXPERIMENTS", "experiment", "target_lines"]

#: Name: what runs it, what renders its page.
EXPERIMENTS = {"ma2014": (ma2014.run, render)}


def experiment(
    name: str,
    *,
    output: str | Path = "build",
    seed: int = 1,
    runs: int = ma2014.RUNS,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Run an experiment and write ``<name>.html`` and ``<name>.json``.

    Parameters
    ----------
    name : str
        One of `EXPERIMENTS`.
    output : path
        Folder for the two files.
    seed : int
        Of the first run.
    runs : int
        How many runs the spread comes from.

    Returns
    -------
    dict
        The contents of the JSON file; ``good`` tells whether every internal claim held. Targets
        are reported in ``targets`` and do not count there.

    Raises
    ------
    InputError
        Unknown name, seed out of range, folder that cannot be written.
    """
    if name not in EXPERIMENTS:
        raise InputError.at(
            "experiment",
            wanted=f"one of {', '.join(EXPERIMENTS)}",
            found=repr(name),
            fix="choose one of these",
        )
    run, page = EXPERIMENTS[name]
    with output_folder(Path(output)) as folder:
        data = run(seed=seed, runs=runs, progress=progress)
        (folder / f"{name}.json").write_text(json.dumps(data, allow_nan=False) + "\n")
        (folder / f"{name}.html").write_text(page(data), encoding="utf-8")
    return data


def target_lines(data: dict[str, Any]) -> list[str]:
    """The targets for people, one line each."""
    return [
        f"{'pass' if t['good'] else 'FAIL'}  {t['name']} ({t['source']}): "
        + " / ".join(f"{x:.3g}" for x in t["ours"])
        + (f" {t['unit']}" if t["unit"] else "")
        for t in data["targets"]
    ]
