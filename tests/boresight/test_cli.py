"""The command line: exit codes, one-line errors, nothing half-written, JSON alone on stdout."""

from __future__ import annotations

import pytest

from boresight.cli import main

pytestmark = pytest.mark.pythons

HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n"
ROW = "{t},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40\n"
GOOD = HEADER + "".join(ROW.format(t=k / 100) for k in range(20))


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(GOOD)
    return path


def refused(capsys, *argv):
    """Run; expect exit code 2 and one line on stderr, nothing on stdout."""
    try:
        code = main([str(a) for a in argv])
    except SystemExit as stop:
        code = stop.code
    out = capsys.readouterr()
    assert code == 2, out
    assert out.out == ""
    assert out.err.count("\n") == 1 and out.err.startswith("error: "), out.err
    return out.err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace("gz", "gq"), "a column gz [rad/s]"),
        (GOOD.replace(",mz\n", "\n").replace(",-40\n", "\n"), "a column mz [uT]"),
        (HEADER + ROW.format(t="zero"), "zero"),
        (HEADER + ROW.format(t=0).replace("9.8", "nan"), "nan"),
        (HEADER + ROW.format(t=1) + ROW.format(t=0), "a time above 1.0"),
        (HEADER, "row"),
        ("", "empty"),
    ],
)
def test_bad_logs(tmp_path, capsys, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    error = refused(capsys, "run", "complementary", path, "-o", tmp_path / "out.csv")
    assert message in error.replace(str(tmp_path), "") and "bad.csv" in error
    assert not (tmp_path / "out.csv").exists()


def test_bad_names_and_widths(log, capsys, tmp_path):
    assert "boresight list" in refused(capsys, "run", "kalman", log)
    assert "mimas" in refused(
        capsys, "compile", "complementary", "--board", "arty", "-o", tmp_path / "x"
    )
    assert "18 to 32" in refused(
        capsys, "compile", "complementary", "--word", "17", "-o", tmp_path / "x"
    )
    assert "small" in refused(
        capsys, "compile", "complementary", "--config", "huge", "-o", tmp_path / "x"
    )
    assert "0 to 32" in refused(capsys, "run", "complementary", log, "--param", "kp_pitch_per_s=33")
    assert "NAME=NUMBER" in refused(capsys, "run", "complementary", log, "--param", "kp=x")
    assert "float, fixed" in refused(capsys, "run", "complementary", log, "--on", "gpu")
    assert "absent.csv" in refused(capsys, "check", "complementary", tmp_path / "absent.csv")
    refused(capsys, "check", "complementary")
    refused(capsys, "fly")
    assert not list((tmp_path / "x").glob("*")) if (tmp_path / "x").exists() else True


def test_output_that_cannot_be_written(log, capsys, tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert "file" in refused(capsys, "compile", "complementary", "-o", blocker)
    assert "file" in refused(capsys, "run", "complementary", log, "-q", "-o", blocker / "out.csv")
    assert blocker.read_text() == ""
