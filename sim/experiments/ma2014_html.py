"""The page of the experiment: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from boresight.sim.experiments.ma2014_plots import plots
from boresight.sim.report.html import number, unit

__all__ = ["render"]

#: Methods of the table that shows what each error does.
_SHOWN = ("gyro", "mag_acc", "ekf_quaternion", "complementary")


def render(data: Mapping[str, Any]) -> str:
    """HTML text of the dict that `sim.experiments.ma2014.run` returns: no script, printable."""
    import jinja2

    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "unit": unit}
    template = environment.from_string(
        files("boresight.sim.experiments").joinpath("ma2014.html").read_text(encoding="utf-8")
    )
    present = data["table_3"]["cases"]["C"]
    return template.render(d=data, plots=plots(data), shown=[k for k in _SHOWN if k in present])
