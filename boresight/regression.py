"""Results beside earlier ones."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from boresight.model.errors import InputError
from boresight.options import Group
from boresight.sim.baseline import compared, read_baseline
from boresight.sim.result import Result


def baseline(result: Result, file: str | Path) -> Result:
    """Compare a result with an earlier one.

    Parameters
    ----------
    result : Result
        Of `boresight.check`, `compile` or `accuracy`.
    file : path
        Output of the verb with ``--json``; or ``json.dumps(result.to_json())``.

    Returns
    -------
    Result
        ``changes``; good unless something is worse than accepted (`sim.baseline`).

    Raises
    ------
    InputError
        A file that is not such a result, or a result of something else.
    """
    if not result.judged:
        raise InputError.at(
            "baseline",
            wanted="a result of check, compile or accuracy",
            found="one of another verb",
            fix="compare one of these",
        )
    earlier = read_baseline(file, result.judged)
    return compared(result.to_json(), earlier, result.judged, file=file)


@Parameter(name="*")
@dataclass(frozen=True)
class Baseline(Group):
    """With which earlier result the result is compared."""

    baseline: Annotated[
        str | None,
        Parameter(
            name="--baseline",
            metavar="FILE",
            help="An earlier result, from --json: fails where a figure is worse than accepted.",
        ),
    ] = None

    def judged(self, result: Result) -> Result:
        """The result, and what has changed since the earlier one."""
        if self.baseline is None:
            return result
        found = baseline(result, self.baseline)
        return dataclasses.replace(
            result,
            data={**result.data, "baseline": found.to_json()},
            summary=f"{result.summary}\n{found.summary}",
            tables={**result.tables, **found.tables},
            notes=(*result.notes, *found.notes),
            failures=(*result.failures, *found.failures),
        )
