"""`boresight check`: its lines, its JSON, the logs that a folder stands for."""

from __future__ import annotations

import importlib
import json
import re
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.model.errors import InputError

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.check")

HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n"
ROW = "{t},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40\n"
GOOD = HEADER + "".join(ROW.format(t=k / 100) for k in range(20))


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(GOOD)
    return path


def test_check_json_is_one_object(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["good"] is True
    assert [v["n_mismatch"] for v in data["results"][0]["verification"]] == [0, 0]


def test_check_prints_a_line_per_level(log, capsys):
    assert main(["check", "complementary", str(log), "--levels", "fixed,c", "-q"]) == 0
    text = capsys.readouterr().out
    assert len(re.findall(r"\[0/20\] mismatches", text)) == 2
    assert text.rstrip().endswith("good")


def test_a_folder_stands_for_its_logs(tmp_path: Path) -> None:
    for name in ("b.csv", "a.npz", "notes.txt", "deep/c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = module.log_files([tmp_path / "notes.txt", tmp_path])
    assert [p.relative_to(tmp_path).as_posix() for p in found] == [
        *("notes.txt", "a.npz", "b.csv", "deep/c.csv")
    ]
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: wanted a log, or a folder with .* without any; "):
        module.log_files([tmp_path / "empty"])
