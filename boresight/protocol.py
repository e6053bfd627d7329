"""`boresight accuracy --protocol`: every filter on trials made harder in one way each."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.disk.output import OutputFile
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.protocol.page import render_page
from boresight.sim.accuracy.protocol.plan import cases_of
from boresight.sim.accuracy.protocol.runs import Campaign, complete, name_of, params_key
from boresight.sim.accuracy.protocol.summary import summary
from boresight.sim.accuracy.protocol.worse import explained
from boresight.sim.montecarlo.journal import Journal
from boresight.sim.records.bundled import bundled, bundled_names, is_comparison
from boresight.sim.worlds.carriers.logs import CARRIERS

__all__ = ["own_trials", "run_protocol"]

#: Draws of each carrier.
SEEDS = (1, 2)


def own_trials() -> list[str]:
    """Trials that need no file of the user's: bundled logs with truth, and draws of carriers."""
    paths = [bundled(name) for name in bundled_names()]
    return [
        *(str(path) for path in paths if not is_comparison(path)),
        *(f"carrier:{name}:{seed}" for name in CARRIERS for seed in SEEDS),
    ]


def run_protocol(
    protocol: str,
    estimators: Sequence[Named],
    peers: Sequence[str],
    logs: Sequence[Path],
    *,
    params: Mapping[str, Mapping[str, float]] | None = None,
    word: int = 32,
    jobs: int | None = None,
    output: str | Path = "build",
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Run a protocol on logs, or on `own_trials`; what is done already stands in the journal.

    Returns
    -------
    dict
        See `sim.accuracy.protocol.summary.summary`; ``good``: fixed point is as near to float64 as
        the outputs' tolerances say, and nothing saturated; ``file``, the page.

    Raises
    ------
    InputError
        No such protocol, an estimator that is no text, a journal of other figures.
    ToolMissing
        The package of a published filter is not here.
    """
    cases = cases_of(protocol)
    texts = [name for name in estimators if isinstance(name, str)]
    if len(texts) != len(estimators):
        raise InputError.at(
            "estimators",
            wanted="names, or file.py:Class, which other processes can read",
            found="objects",
            fix="give texts, or leave the protocol out",
        )
    require_peers([PEERS[name] for name in peers])
    campaign = Campaign(
        protocol,
        tuple(map(str, logs)) or tuple(own_trials()),
        tuple(texts),
        tuple(peers),
        params_key(params),
        word,
    )
    folder = Path(output)
    page, table = (
        OutputFile(folder / f"accuracy-{protocol}.{end}", "accuracy", of=protocol, inputs=logs)
        for end in ("html", "json")
    )
    journal = Journal(folder / f"accuracy-{protocol}.runs", campaign.identity())
    runs = complete(campaign, journal, say=progress or (lambda text: None), jobs=jobs)
    data = {
        "protocol": protocol,
        "word": word,
        "trial_names": [name_of(trial) for trial in campaign.trials],
        **summary(cases, runs),
    }
    data["worse"] = [explained(campaign, cases, runs, name) for name in texts if data["rival"]]
    data["good"] = all(f["good"] for f in data["fixed"])
    table.write(json.dumps(data, allow_nan=False) + "\n")
    page.write(render_page(data))
    return data | {"file": str(folder / f"accuracy-{protocol}.html")}
