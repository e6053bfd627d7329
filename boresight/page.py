"""The report page of `boresight check -o`: a core's schedule, area, clock and errors."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from urllib.parse import quote

from boresight.core_files import write_text
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.estimator import Estimator
from boresight.model.tools.files import output_folder
from boresight.sim.compare.results import CheckResult
from boresight.sim.explore.measure import map_core
from boresight.sim.levels.build import Build
from boresight.sim.report.data import report_data
from boresight.sim.report.html import render_html


def write_page(
    folder: Path,
    estimator: Estimator,
    build: Build,
    results: Sequence[CheckResult],
    inputs: Sequence[Path],
    tell: Callable[[str], None],
) -> str:
    """Write report.html and report.json; returns the name of the page."""
    part = TARGETS.get(build.target, TARGETS["xc6slx9"])
    files = ("report.html", "report.json")
    with output_folder(folder, "check", files=files, inputs=inputs) as place:
        tell(f"synthesis (yosys) for {part.title}")
        area = map_core(build.core, part)
        data = report_data(build.core, *results, area=area, device=part.device, grade=part.grade)
        write_text(place / "report.json", json.dumps(data, indent=1) + "\n")
        write_text(place / "report.html", render_html(data, links=links_of(estimator, folder)))
    return str(folder / "report.html")


def links_of(estimator: Estimator, folder: Path) -> dict[str, str]:
    """Addresses, seen from a folder, of the files that an estimator of the user's is written in.

    By name; files that share a name are left out.
    """
    links: dict[str, set[str]] = {}
    for cls in type(estimator).__mro__:
        if cls.__module__.partition(".")[0] in ("boresight", "builtins"):
            continue
        for member in (*vars(cls).values(), *vars(sys.modules.get(cls.__module__, cls)).values()):
            code = getattr(member, "__code__", None)
            if code is not None and Path(code.co_filename).is_file():
                path = Path(code.co_filename).resolve()
                links.setdefault(path.name, set()).add(os.path.relpath(path, folder.resolve()))
    return {name: quote(*paths) for name, paths in links.items() if len(paths) == 1}
