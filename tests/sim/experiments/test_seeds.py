"""Cases of many seeds: the same figures however they are dealt out."""

import numpy as np
import pytest

from boresight.sim.experiments.seeds import Runs, run_cases


def squares(case: float, seeds: range) -> Runs:
    """A figure for each way of pooling, of the seeds."""
    values = case * np.array(seeds, dtype=float)
    names = ("angle_rms", "peak_max", "count_sum", "rate", "max_share")
    return Runs({n: values for n in names}, {"first": values[0]}, [*seeds])


CASES = [("one", 1.0, 5), ("ten", 10.0, 2)]


@pytest.mark.parametrize("at_once, jobs", [(5, 1), (2, 1), (2, 2)])
def test_portions_and_processes_change_nothing(at_once: int, jobs: int) -> None:
    told: list[str] = []
    found = run_cases(squares, CASES, seed=3, at_once=at_once, jobs=jobs, say=told.append)
    assert list(found) == ["one", "ten"]
    assert found["one"].figures["rate"].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]
    assert found["ten"].figures["rate"].tolist() == [30.0, 40.0]
    assert found["one"].shown == {"first": 3.0} and found["one"].each == [3, 4, 5, 6, 7]
    tasks = {5: 2, 2: 4}[at_once]
    assert len(told) == tasks and told[-1].startswith(f"{tasks} of {tasks}: ")


def test_pooled() -> None:
    pooled = squares(1.0, range(3, 5)).pooled()
    assert pooled == {
        "angle_rms": pytest.approx(np.sqrt(12.5)),
        "peak_max": 4.0,
        "count_sum": 7.0,
        "rate": 3.5,
        "max_share": 3.5,
    }
