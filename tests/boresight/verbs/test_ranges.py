"""``boresight ranges``: exit codes, JSON, the log of a witness."""

import json

import pytest

from boresight.cli import main
from boresight.sim.records.files import read_record

TEXT = """
from boresight import Estimator, Input, Output, ops


class Half(Estimator):
    inputs = (Input("a", -1.0, 1.0, "m"),)
    outputs = (Output("y", "m", tolerance=1e-6),)

    def step(self, x, u, p):
        return {}, {"y": ops.bounded(u.a - 0.5 * u.a, -LIMIT, LIMIT, "half of it")}
"""


@pytest.mark.parametrize(("limit", "code"), [("0.5", 0), ("0.3", 1)])
def test_ranges(limit, code, tmp_path, capsys):
    path, log = tmp_path / "half.py", tmp_path / "broken.csv"
    path.write_text(TEXT.replace("LIMIT", limit))
    common = ["ranges", str(path), "--updates", "2000"]
    assert main([*common, "--json", "--witness", str(log)]) == code
    (claim,) = json.loads(capsys.readouterr().out)["claims"]
    assert claim["line"] == "half.py, line 10" or claim["line"].endswith("line 10")
    assert claim["status"] == ("refuted" if code else "proven")
    assert log.exists() == bool(code)
    assert main(common) == code
    out = capsys.readouterr().out
    if code:
        a = read_record(log).values("a", "m")
        assert abs(0.5 * a[-1]) > 0.3 and len(a) == len(claim["witness"]["inputs"]["a"])
        assert "  refuted     [-0.3, 0.3] half of it" in out and "BAD: 1 refuted" in out
    else:
        assert "1 claim: 1 proven" in out and "  proven      [-" in out and "half of it" in out
        assert out.rstrip().endswith("good")


def test_wrong_numbers(capsys):
    assert main(["ranges", "mekf", "--updates", "0"]) == 2
    assert "updates" in capsys.readouterr().err
