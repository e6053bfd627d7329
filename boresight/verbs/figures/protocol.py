"""`boresight accuracy --protocol`: every filter on trials made harder in one way each."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from boresight.filters import chosen
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.tools.files import OutputFile
from boresight.options import Jobs, OutputFolder, Params, Word
from boresight.results.protocol import ProtocolResult
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.attitude.robustness.logs import CARRIERS
from boresight.sim.attitude.robustness.page import render_page
from boresight.sim.attitude.robustness.plan import cases_of
from boresight.sim.attitude.robustness.runs import (
    Campaign,
    name_of,
    params_key,
    run_cases,
    tasks_of,
)
from boresight.sim.attitude.robustness.summary import summary
from boresight.sim.attitude.robustness.worse import explained
from boresight.sim.campaign import Journal, complete
from boresight.sim.records.bundled import bundled, bundled_names, is_comparison
from boresight.sim.records.files import log_files

__all__ = ["accuracy_protocol", "own_trials"]

#: Draws of each carrier.
SEEDS = (1, 2)


def own_trials() -> list[str]:
    """Trials that need no file of the user's: bundled logs with truth, and draws of carriers."""
    paths = [bundled(name) for name in bundled_names()]
    return [
        *(str(path) for path in paths if not is_comparison(path)),
        *(f"carrier:{name}:{seed}" for name in CARRIERS for seed in SEEDS),
    ]


def accuracy_protocol(
    protocol: str,
    names: Named | Sequence[Named],
    *logs: str | Path,
    params: Params = None,
    word: Word = 32,
    jobs: Jobs = None,
    output: OutputFolder = "build",
    progress: Callable[[str], None] | None = None,
) -> ProtocolResult:
    """Attitude filters on logs that are made harder in one way each.

    Every log is cut to start in motion, biased, resampled, turned, blinded, ...; what was done
    before stands in a journal beside the page, and is not done again.

    Parameters
    ----------
    protocol : str
        "full", "short" or "glance".
    names : str or several
        As of `boresight.accuracy`; names and ``file.py:Class``, no objects: other processes read
        them.
    logs : paths
        Logs, or folders of logs; by default bundled ones and synthetic carriers (`own_trials`).
    params : mapping, optional
        Parameter values by estimator.
    word : int
        Word width.
    jobs : int, optional
        Processes; one for each processor by default.
    output : path
        Folder for accuracy-PROTOCOL.html, .json and .jsonl.

    Returns
    -------
    ProtocolResult
        Means of every group of cases, ratios to the rival, and how near fixed point is to float64.

    Raises
    ------
    InputError
        No such protocol, an estimator that is no text, a bad log, a journal of other figures,
        a published filter whose package is not installed.
    """
    cases = cases_of(protocol)
    estimators, peers = chosen(names)
    texts = [name for name in estimators if isinstance(name, str)]
    if len(texts) != len(estimators):
        raise InputError.at(
            "estimators",
            wanted="names, or file.py:Class, which other processes can read",
            found="objects",
            fix="give texts, or leave the protocol out",
        )
    require_peers([PEERS[name] for name in peers])
    files = log_files(logs) if logs else []
    campaign = Campaign(
        protocol,
        tuple(map(str, files)) or tuple(own_trials()),
        tuple(texts),
        tuple(peers),
        params_key(params),
        word,
    )
    folder = Path(output)
    page, table = (
        OutputFile(folder / f"accuracy-{protocol}.{end}", inputs=files) for end in ("html", "json")
    )
    journal = Journal(folder / f"accuracy-{protocol}.jsonl")
    runs = complete(
        campaign,
        run_cases,
        tasks_of(campaign),
        journal,
        say=progress or (lambda text: None),
        jobs=jobs,
    )
    data = {
        "protocol": protocol,
        "word": word,
        "trial_names": [name_of(trial) for trial in campaign.trials],
        **summary(cases, runs),
    }
    data["worse"] = [explained(campaign, cases, runs, name) for name in texts if data["rival"]]
    ran_nothing = {r["filter"] for r in data["refused"] if r["runs"] == r["of"]}
    data["good"] = all(f["good"] for f in data["fixed"]) and ran_nothing.isdisjoint(texts)
    table.write(json.dumps(data, allow_nan=False) + "\n")
    page.write(render_page(data))
    return ProtocolResult.of(data, folder / f"accuracy-{protocol}.html")
