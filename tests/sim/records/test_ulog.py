"""PX4's flight logs: topics to rows, axes, times, damage."""

from pathlib import Path

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.files import read_record
from boresight.sim.rotations.rotation import rotate
from tests.support.flights import TURN, at_rest, flight


def test_topics_become_a_nine_axis_record(tmp_path: Path) -> None:
    (tmp_path / "flight.ulg").write_bytes(flight())
    record = read_record(tmp_path / "flight.ulg")
    columns = {name: column.values for name, column in record.columns.items()}
    assert record.name == "flight"
    assert columns["t"] == pytest.approx(0.004 * np.arange(10))
    first = [columns[n][0] for n in ("gx", "gy", "gz", "ax", "ay", "az")]
    assert first == pytest.approx([0.1, -0.2, -0.3, 1.0, -2.0, 9.0])
    assert np.flatnonzero(~np.isnan(columns["mx"])).tolist() == [2, 6]
    assert [record.values(n, "uT")[2] for n in ("mx", "my", "mz")] == pytest.approx(
        [20.0, -10.0, -40.0]
    )
    known = ~np.isnan(columns["qw"])
    assert np.flatnonzero(known).tolist() == list(range(1, 7))  # between two of them
    q = np.stack([columns[f"q{c}"][known] for c in "wxyz"], axis=1)
    for body in np.eye(3):
        n, e, d = rotate(np.array(TURN), body * [1.0, -1.0, -1.0])  # the same vector in PX4's axes
        assert rotate(q, np.tile(body, (len(q), 1))) == pytest.approx(
            np.tile([e, n, -d], (len(q), 1)), abs=1e-6
        )


@pytest.mark.parametrize("name", ["sensor_combined", "vehicle_magnetometer"])
def test_a_missing_topic_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.ulg").write_bytes(flight(*(n for n in at_rest() if n != name)))
    with pytest.raises(InputError, match=f"a.ulg: wanted the topic {name}, found .*attitude"):
        read_record(tmp_path / "a.ulg")


def test_a_log_that_ends_early_has_the_rows_before(tmp_path: Path) -> None:
    """The power fails in the middle of a message."""
    (tmp_path / "whole.ulg").write_bytes(flight("vehicle_magnetometer", "sensor_combined"))
    content = (tmp_path / "whole.ulg").read_bytes()
    (tmp_path / "cut.ulg").write_bytes(content[:-50])
    whole, cut = (read_record(tmp_path / f"{name}.ulg") for name in ("whole", "cut"))
    assert (len(whole), len(cut)) == (10, 8)
    assert whole.notes == () and "ends in the middle of a message" in cut.notes[0]
