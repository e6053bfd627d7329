"""The page of the experiment: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.sim.attitude.ma2014 import paper, world
from boresight.sim.attitude.ma2014.devices import FACTS
from boresight.sim.attitude.ma2014.plots import plots
from boresight.sim.experiments.experiment import Target, grouped
from boresight.sim.pages import page

__all__ = ["render"]

#: Methods of the table that shows what each error does.
_SHOWN = ("gyro", "mag_acc", "ekf_quaternion", "complementary")


def render(details: Mapping[str, Any], targets: Sequence[Target]) -> str:
    """HTML text of the measured and judged figures: no script, printable."""
    return page(
        "boresight.sim.attitude.ma2014",
        "page.html",
        d=details,
        plots=plots(details),
        paper=paper,
        world=world,
        facts=FACTS,
        shown=_SHOWN,
        judged=[t for t in targets if t.judged],
        groups=grouped(t for t in targets if not t.binding),
        equalities=[t for t in targets if t.binding],
    )
