"""One log under two suffixes; test_text.py and test_archive.py have what each refuses."""

from pathlib import Path

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import content_of, read_record


@pytest.mark.parametrize("name", ["log.csv", "log.txt", "log", "log.npz", "LOG.NPZ"])
def test_what_is_written_is_read_back(name: str, tmp_path: Path) -> None:
    record = read_record(bundled("synthetic_60s")).head(20)
    path = tmp_path / name
    path.write_bytes(content_of(path, record))
    assert path.read_bytes().startswith(b"PK") == name.lower().endswith(".npz")
    again = read_record(str(path))
    assert again.columns.keys() == record.columns.keys()
    for column, wanted in record.columns.items():
        np.testing.assert_array_equal(again.columns[column].values, wanted.values)


def test_the_suffix_decides(tmp_path: Path) -> None:
    record = read_record(bundled("synthetic_60s")).head(3)
    (tmp_path / "log.npz").write_bytes(content_of("log.csv", record))
    with pytest.raises(InputError, match=r"log\.npz: wanted "):
        read_record(tmp_path / "log.npz")
    with pytest.raises(InputError, match="wanted a log file that can be read, found no such file"):
        read_record(tmp_path / "none.csv")
