"""Results beside those of an earlier day."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from boresight.model.errors import InputError
from boresight.options import Group
from boresight.sim.baseline import compared, read_baseline
from boresight.sim.result import Result

__all__ = ["Baseline", "baseline"]


def baseline(
    result: Result, file: str | Path, *, allow: Mapping[str, float] | None = None
) -> Result:
    """Compare a result with that of an earlier day.

    Parameters
    ----------
    result : Result
        Of `boresight.check`, `compile` or `accuracy`.
    file : path
        Output of the verb with ``--json``; or ``json.dumps(result.to_json())``.
    allow : mapping of str to float
        Accepted shares of worsening other than `boresight.sim.baseline.SHARES`, by kind of figure.

    Returns
    -------
    Result
        ``changes``; good unless something got worse by more than accepted.

    Raises
    ------
    InputError
        A file that is no such result, a result of something else, an unknown kind.
    """
    if not result.judged:
        raise InputError.at(
            "baseline",
            wanted="a result of check, compile or accuracy",
            found="one of another verb",
            fix="compare one of these",
        )
    earlier = read_baseline(file, result.judged)
    found = compared(result.to_json(), earlier, result.judged, file=file, allow=allow)
    lines = str(found).splitlines()
    failures = [line.removeprefix("FAILED: ") for line in lines if line.startswith("FAILED: ")]
    shown = [line for line in lines if not line.startswith("FAILED: ")]
    return Result(
        {"changes": found.changes, "equal": found.equal},
        summary="\n".join(shown),
        failures=failures,
    )


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
            failures=(*result.failures, *found.failures),
        )
