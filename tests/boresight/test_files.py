"""Destructive attempts: every verb that writes, and every way in which files could be harmed.

In each refused attempt all that stands in the folder is the same afterwards, to the inode, and no
work was done. In each interrupted one the user's files are the same and nothing is left behind.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import boresight
from boresight.cli import main
from boresight.core_files import core_files, project_files
from boresight.disk.manifest import NAME
from boresight.disk.output import OutputFile, output_folder
from boresight.sim.attitude.soc import __main__ as firmware
from boresight.sim.data import convert_ximu, make_synthetic
from boresight.sim.experiments.experiment import Result
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import FORMATS, log_files

pytestmark = pytest.mark.pythons

LOG = "t,gx,gy,gz,ax,ay,az,mx,my,mz,qw,qx,qy,qz\n" + "".join(
    f"{k / 100},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40,1,0,0,0\n" for k in range(20)
)
Verb = tuple[Callable[[list[str]], int], list[str], str, str]

#: Verbs that write one file: entry point, arguments before the output's name, the input that it
#: could hit, and where the work begins.
FILES: dict[str, Verb] = {
    "run": (main, ["run", "mekf", "log.csv", "-q", "-o"], "log.csv", "boresight.verbs.run.feeds"),
    "tune": (
        main,
        ["tune", "mekf", "log.csv", "-q", "-o"],
        "log.csv",
        "boresight.verbs.figures.tune.Scorer",
    ),
    "csv": (
        main,
        ["monitor", "capture.bin", "--csv"],
        "capture.bin",
        "boresight.verbs.monitor.BoardLine",
    ),
    "plot": (
        main,
        ["monitor", "capture.bin", "--plot"],
        "capture.bin",
        "boresight.verbs.monitor.BoardLine",
    ),
    "reproducer": (
        main,
        ["check", "mekf", "log.csv", "--reproducer"],
        "log.csv",
        "boresight.verbs.check.Check.run",
    ),
    "make_synthetic": (
        make_synthetic.main,
        [],
        "log.csv",
        "boresight.sim.data.make_synthetic.synthetic_60s",
    ),
    "convert_ximu": (
        convert_ximu.main,
        ["ximu"],
        "ximu/1_Quaternion.csv",
        "boresight.sim.data.convert_ximu.convert",
    ),
}
#: Verbs that fill a folder: as above, but for one of the files that they write.
FOLDERS: dict[str, Verb] = {
    "compile": (
        main,
        ["compile", "mekf", "--board", "mimas", "-q", "-o"],
        "firmware/mekf.c",
        "boresight.sim.levels.build.build_shared_core",
    ),
    "report": (
        main,
        ["report", "mekf", "log.csv", "-q", "-o"],
        "report.html",
        "boresight.verbs.report.Check.run",
    ),
    "accuracy": (
        main,
        ["accuracy", "complementary", "log.csv", "-q", "-o"],
        "accuracy.json",
        "boresight.verbs.figures.accuracy.benchmark",
    ),
    "experiment ma2014": (
        main,
        ["experiment", "ma2014", "-q", "-o"],
        "ma2014.json",
        "boresight.sim.attitude.ma2014.experiment.Ma2014.run",
    ),
    "simulate": (
        main,
        ["simulate", "--seconds", "0.1", "-q", "-o"],
        "board.html",
        "boresight.verbs.simulate.system_core",
    ),
    "demo": (
        main,
        ["demo", "-q", "-o"],
        "core-fast/firmware/mekf.c",
        "boresight.sim.levels.build.build_shared_core",
    ),
    "firmware": (
        firmware.main,
        ["--updates", "2", "-o"],
        "report.json",
        "boresight.sim.attitude.soc.__main__.compare",
    ),
}


def written(path: Path, verb: str) -> None:
    """A file as an earlier run of the verb left it."""
    OutputFile(path, verb).write("ours")


# -- traps: each sets something up around the output's place and gives the argument ----------------


def users_file(place: Path, verb: str, input_path: Path) -> str:
    place.write_text("user")
    return str(place)


def users_empty_file(place: Path, verb: str, input_path: Path) -> str:
    place.touch()
    return str(place)


def edited(place: Path, verb: str, input_path: Path) -> str:
    written(place, verb)
    place.write_text("ours, and the user's notes")
    return str(place)


def protected(place: Path, verb: str, input_path: Path) -> str:
    written(place, verb)
    place.chmod(0o444)
    return str(place)


def the_input(place: Path, verb: str, input_path: Path) -> str:
    return str(input_path)


def our_input(place: Path, verb: str, input_path: Path) -> str:
    """Written by us, and read now."""
    text = input_path.read_bytes()
    input_path.unlink()
    OutputFile(input_path, verb).write(text)
    return str(input_path)


def link_to_input(place: Path, verb: str, input_path: Path) -> str:
    place.symlink_to(input_path)
    return str(place)


def second_name_of_input(place: Path, verb: str, input_path: Path) -> str:
    os.link(input_path, place)
    return str(place)


def input_through_a_folder(place: Path, verb: str, input_path: Path) -> str:
    (place.parent / "alias").symlink_to(input_path.parent)
    return str(place.parent / "alias" / input_path.name)


def link_to_users_file(place: Path, verb: str, input_path: Path) -> str:
    place.symlink_to("notes.txt")
    return str(place)


def circle(place: Path, verb: str, input_path: Path) -> str:
    place.symlink_to(place.name)
    return str(place)


def link_into_nowhere(place: Path, verb: str, input_path: Path) -> str:
    place.symlink_to("none/at/all")
    return str(place)


def folder(place: Path, verb: str, input_path: Path) -> str:
    place.mkdir()
    return str(place)


def folders_name(place: Path, verb: str, input_path: Path) -> str:
    return f"{place}/"


def a_socket(place: Path, verb: str, input_path: Path) -> str:
    with socket.socket(socket.AF_UNIX) as end:
        end.bind(place.name)
    return str(place)


def below_a_file(place: Path, verb: str, input_path: Path) -> str:
    return str(place.parent / "notes.txt" / "sub" / place.name)


def no_name(place: Path, verb: str, input_path: Path) -> str:
    return ""


def blank_name(place: Path, verb: str, input_path: Path) -> str:
    return " "


def too_long(place: Path, verb: str, input_path: Path) -> str:
    return str(place.with_name("x" * 300 + place.suffix))


def closed_to_all(place: Path, verb: str, input_path: Path) -> str:
    return f"/proc/{place.name}"


def full(place: Path, verb: str, input_path: Path) -> str:
    return "/dev/full"


def not_open(place: Path, verb: str, input_path: Path) -> str:
    return "/dev/fd/977"


def users_manifest(place: Path, verb: str, input_path: Path) -> str:
    (place.parent / NAME).write_text("user")
    return str(place)


FILE_TRAPS = (
    *(users_file, users_empty_file, edited, protected, the_input, our_input, link_to_input),
    *(second_name_of_input, input_through_a_folder, link_to_users_file, circle, link_into_nowhere),
    *(folder, folders_name, a_socket, below_a_file, no_name, blank_name, too_long, closed_to_all),
    *(full, not_open, users_manifest),
)


def in_folder(place: Path, verb: str, name: str) -> Path:
    path = place / name
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def users_file_in_it(place: Path, verb: str, name: str) -> str:
    in_folder(place, verb, name).write_text("user")
    return str(place)


def edited_in_it(place: Path, verb: str, name: str) -> str:
    with output_folder(place, verb) as staged:
        in_folder(staged, verb, name).write_text("ours")
    (place / name).write_text("edited")
    return str(place)


def edited_and_no_longer_written(place: Path, verb: str, name: str) -> str:
    with output_folder(place, verb) as staged:
        (staged / "old.txt").write_text("ours")
    (place / "old.txt").write_text("edited")
    return str(place)


def link_in_it(place: Path, verb: str, name: str) -> str:
    in_folder(place, verb, name).symlink_to(place.parent / "notes.txt")
    return str(place)


def second_name_in_it(place: Path, verb: str, name: str) -> str:
    os.link(place.parent / "notes.txt", in_folder(place, verb, name))
    return str(place)


def folder_in_it(place: Path, verb: str, name: str) -> str:
    in_folder(place, verb, name).mkdir()
    return str(place)


def socket_in_it(place: Path, verb: str, name: str) -> str:
    at = in_folder(place, verb, name)
    with socket.socket(socket.AF_UNIX) as end, contextlib.chdir(at.parent):
        end.bind(at.name)
    return str(place)


def file_instead_of_it(place: Path, verb: str, name: str) -> str:
    place.write_text("user")
    return str(place)


def link_to_a_file_instead_of_it(place: Path, verb: str, name: str) -> str:
    place.symlink_to("notes.txt")
    return str(place)


def file_instead_of_its_folder(place: Path, verb: str, name: str) -> str:
    place.mkdir()
    (place / Path(name).parts[0]).write_text("user")
    return str(place)


def manifest_in_it(place: Path, verb: str, name: str) -> str:
    place.mkdir()
    (place / NAME).write_text("user")
    return str(place)


def nothing(place: Path, verb: str, name: str) -> str:
    return os.devnull


def as_a_file(trap: Callable[[Path, str, Path], str]) -> Callable[[Path, str, str], str]:
    def of_folder(place: Path, verb: str, name: str) -> str:
        return trap(place, verb, Path(name))

    of_folder.__name__ = trap.__name__
    return of_folder


FOLDER_TRAPS = (
    *(users_file_in_it, edited_in_it, edited_and_no_longer_written, link_in_it, second_name_in_it),
    *(folder_in_it, socket_in_it, file_instead_of_it, link_to_a_file_instead_of_it),
    *(file_instead_of_its_folder, manifest_in_it, nothing),
    *map(as_a_file, (circle, below_a_file, no_name, blank_name, too_long, closed_to_all)),
)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of the user, and the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "capture.bin").write_bytes(b"\xc0capture\xc0")
    (tmp_path / "notes.txt").write_text("user")
    (tmp_path / "ximu").mkdir()
    for kind in ("CalInertialAndMag", "Quaternion", "Registers"):
        (tmp_path / "ximu" / f"1_{kind}.csv").write_text("user")
    return tmp_path


def everything(root: Path) -> dict[str, tuple[object, ...]]:
    """All that stands in a folder: kind, permissions, inode, names, contents or target."""
    results: dict[str, tuple[object, ...]] = {}
    for path in sorted(root.rglob("*")):
        is_ = path.lstat()
        text: object = path.readlink() if path.is_symlink() else None
        if stat.S_ISREG(is_.st_mode):
            text = path.read_bytes()
        results[str(path.relative_to(root))] = (is_.st_mode, is_.st_ino, is_.st_nlink, text)
    return results


def refused(verb: Verb, argument: str, capsys: pytest.CaptureFixture[str], patch: Any) -> str:
    """Run; expect exit code 2, one line, and no work."""
    call, arguments, _, work = verb
    patch.setattr(work, lambda *a, **k: pytest.fail("work was done"))
    capsys.readouterr()
    assert call([*arguments, argument]) == 2
    out = capsys.readouterr()
    assert out.out == "" and out.err.startswith("error: ") and out.err.count("\n") == 1, out
    return out.err


@pytest.mark.parametrize("trap", FILE_TRAPS, ids=lambda t: t.__name__)
@pytest.mark.parametrize("verb", FILES)
def test_files(verb: str, trap: Any, home: Path, capsys: Any, monkeypatch: Any) -> None:
    if (verb, trap) == ("make_synthetic", our_input):
        return  # it has no input
    place = home / ("out.png" if verb == "plot" else "out.csv")
    argument = trap(place, verb, home / FILES[verb][2])
    before = everything(home)
    refused(FILES[verb], argument, capsys, monkeypatch)
    assert everything(home) == before


@pytest.mark.parametrize("trap", FOLDER_TRAPS, ids=lambda t: t.__name__)
@pytest.mark.parametrize("verb", FOLDERS)
def test_folders(verb: str, trap: Any, home: Path, capsys: Any, monkeypatch: Any) -> None:
    argument = trap(home / "out", verb, FOLDERS[verb][2])
    before = everything(home)
    refused(FOLDERS[verb], argument, capsys, monkeypatch)
    assert everything(home) == before


@pytest.mark.parametrize("option", ["output", "table", "map"])
def test_other_inputs(option: str, home: Path, capsys: Any, monkeypatch: Any) -> None:
    """Parameter files, register maps, and two outputs in one."""
    OutputFile("p.json", "tune").write('{"gyr_noise": 1e-4}')
    words = {
        "output": ["tune", "complementary", "log.csv", "--params", "p.json", "-o", "./p.json"],
        "table": ["monitor", "capture.bin", "--csv", "x.png", "--plot", "./x.png"],
        "map": ["monitor", "capture.bin", "--map", "p.json", "--csv", "p.json"],
    }[option]
    before = everything(home)
    verb = (main, words[:-1], "", "boresight.verbs.monitor.BoardLine")
    assert "same file" in refused(verb, words[-1], capsys, monkeypatch)
    assert everything(home) == before


def test_the_default_reproducer_steps_aside(home: Path, monkeypatch: Any, capsys: Any) -> None:
    (home / "reproducer.json").write_text("user")
    names = []

    def work(*args: Any, reproducer: OutputFile, **options: Any) -> Any:
        reproducer.write("difference")
        names.append(reproducer)
        raise KeyboardInterrupt

    monkeypatch.setattr("boresight.verbs.check.Check.run", work)
    assert main(["check", "mekf", "log.csv"]) == 130
    assert names and (home / "reproducer.json").read_text() == "user"
    assert (home / "reproducer-2.json").read_text() == "difference"


# -- what may be written --------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["new", "again", "through a link", "into nothing", "into a FIFO"])
def test_run_writes(how: str, home: Path, capsys: Any) -> None:
    words = ["run", "complementary", "log.csv", "--on", "float", "-q", "-o"]
    users = everything(home)
    place = "deep/new/out.csv"
    got = []
    if how == "again":
        assert main([*words, place]) == 0
    elif how == "through a link":
        (home / "real").mkdir()
        (home / "link.csv").symlink_to("real/out.csv")
        place = "link.csv"
    elif how == "into nothing":
        place = os.devnull
    elif how == "into a FIFO":
        os.mkfifo("fifo")
        place = "fifo"
        reader = threading.Thread(target=lambda: got.append(Path("fifo").read_text()))
        reader.start()
    assert main([*words, place]) == 0
    if how == "into a FIFO":
        reader.join(10)
        assert got[0].count("\n") == 21 and Path("fifo").is_fifo()
    elif how == "into nothing":
        assert Path(os.devnull).is_char_device()
    else:
        assert Path(place).read_text().count("\n") == 21
    after = everything(home)
    assert {name: after[name] for name in users} == users
    new = set(after) - set(users)
    assert (
        new
        == {
            "new": {"deep", "deep/new", "deep/new/out.csv", f"deep/new/{NAME}"},
            "again": {"deep", "deep/new", "deep/new/out.csv", f"deep/new/{NAME}"},
            "through a link": {"link.csv", "real", "real/out.csv", f"real/{NAME}"},
            "into nothing": set(),
            "into a FIFO": {"fifo"},
        }[how]
    )
    if how == "through a link":
        assert Path("link.csv").readlink() == Path("real/out.csv")


def test_compile_clears_the_other_program_and_leaves_the_user(home: Path, capsys: Any) -> None:
    words = ["compile", "-q", "-o", "out"]
    both = ["complementary", "complementary_as_printed"]
    assert main([*words, *both, "--board", "mimas", "--top", "records"]) == 0
    results = {p.relative_to("out").as_posix() for p in Path("out").rglob("*") if p.is_file()}
    assert results == {*core_files(both), *project_files("mimas", system=False), NAME}
    (home / "out" / "firmware" / "mine.c").write_text("user")
    (home / "out" / "ise-mimas" / "top.bit").write_text("user")
    assert main([*words, "complementary"]) == 0
    files = {p.relative_to(home / "out").as_posix() for p in (home / "out").rglob("*")}
    assert not [name for name in files if "as_printed" in name]
    assert {n for n in files if n.startswith("ise")} == {"ise-mimas", "ise-mimas/top.bit"}
    assert {"firmware/mine.c", "firmware/complementary.c", "core.v", "microcode.lst"} <= files
    assert (home / "out" / "firmware" / "mine.c").read_text() == "user"


# -- interruptions --------------------------------------------------------------------------------

SLEEPS = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # not as in the background
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # not as under nohup
from boresight.cli import main
from unittest.mock import patch
def work(*args, **options):
    print("at work", flush=True)
    time.sleep(20)
with patch(sys.argv[1], work):
    sys.exit(main(sys.argv[2:]))
"""


def interrupted(verb: Verb, number: signal.Signals, home: Path) -> int:
    """Send a signal in the middle of the work; the exit code."""
    call, arguments, _, work = verb
    with subprocess.Popen(
        [sys.executable, "-c", SLEEPS, work, *arguments, "new/deep/out.png"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=home,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == b"at work\n", process.stderr.read()
        process.send_signal(number)
        assert process.stdout.read() == b""
        assert b"Traceback" not in process.stderr.read()
    return process.returncode


@pytest.mark.parametrize("verb", ["run", "report"])
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_ended_in_the_middle(verb: str, number: signal.Signals, code: int, home: Path) -> None:
    before = everything(home)
    assert interrupted((FILES | FOLDERS)[verb], number, home) == code
    assert everything(home) == before


#: A run of several pieces, for each suffix one process, which ends itself in the third piece.
PIECES = """
import importlib, os, signal, sys
import pyarrow.compute, pyarrow.csv, pyarrow.feather, pyarrow.parquet, scipy.io  # once
signal.signal(signal.SIGINT, signal.default_int_handler)
module = importlib.import_module("boresight.verbs.run")
from boresight.cli import main
module._ROWS, record, done = 1000, module._record, []
def ended(*arguments):
    done.append(arguments)
    if len(done) == 3:
        os.kill(os.getpid(), number)
    return record(*arguments)
module._record = ended
for suffix in sys.argv[2:]:
    for number in (signal.SIGINT, signal.SIGKILL):
        if not (child := os.fork()):
            os._exit(main(["run", "rate.py", sys.argv[1], "--on", "c", "-o", "out" + suffix]))
        print(suffix, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


RATE = """
from boresight import Estimator, Input, Output
class Rate(Estimator):
    inputs = (Input("gx", -40.0, 40.0, "rad/s"),)
    outputs = (Output("y", "rad/s"),)
    def step(self, x, u, p):
        return {}, {"y": u.gx}
"""


def test_ended_between_pieces(tmp_path: Path) -> None:
    """What was there before stays, and no part of a log under any name that is read."""
    log = bundled("synthetic_60s")
    (tmp_path / "rate.py").write_text(RATE)
    for suffix in FORMATS:
        output = tmp_path / f"out{suffix}"
        boresight.run(str(tmp_path / "rate.py"), log, on="c", steps=9, output=output)
    before = everything(tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", PIECES, str(log), *reversed(FORMATS)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    codes = [f"{suffix} {code}" for suffix in reversed(FORMATS) for code in (130, -9)]
    assert done.stdout.splitlines() == codes and "Traceback" not in done.stderr
    left = everything(tmp_path)
    assert {n: left[n] for n in before} == before
    parts = set(left) - set(before)
    assert all(n.startswith(".") for n in parts) and any(n.endswith("/out.csv") for n in parts)
    assert log_files([tmp_path]) == sorted(tmp_path / f"out{suffix}" for suffix in FORMATS)


def test_killed_in_the_middle_and_run_again(home: Path, monkeypatch: Any, capsys: Any) -> None:
    before = everything(home)
    assert interrupted(FOLDERS["report"], signal.SIGKILL, home) == -9
    left = everything(home)
    assert {name: left[name] for name in before} == before
    assert all(name.startswith("new") for name in set(left) - set(before))
    assert not [p for p in (home / "new").rglob("*") if p.is_file()]  # nothing like a result
    result = Result(figures={}, targets=(), pages={"ma2014.html": "page"})
    run = "boresight.sim.attitude.ma2014.experiment.Ma2014.run"
    monkeypatch.setattr(run, lambda *_, **__: result)
    assert main(["experiment", "ma2014", "-q", "-o", "new/deep/out.png"]) == 0
    assert sorted(p.name for p in (home / "new/deep/out.png").iterdir()) == [
        NAME,
        "ma2014.html",
        "ma2014.json",
    ]


# -- without permission, also when root runs the tests --------------------------------------------


@contextlib.contextmanager
def unprivileged() -> Iterator[Path]:
    """A folder that is closed for writing, seen by a user who is not root."""
    place = Path(tempfile.mkdtemp())
    user = os.getuid()
    (place / "sub").mkdir()
    (place / "log.csv").write_text(LOG)
    for path in (place / "sub", place):
        path.chmod(0o555)
    try:
        if user == 0:
            os.setresgid(65534, 65534, 0)
            os.setresuid(65534, 65534, 0)
        yield place
    finally:
        if user == 0:
            os.setresuid(0, 0, 0)
            os.setresgid(0, 0, 0)
        place.chmod(0o755)
        shutil.rmtree(place)


@pytest.mark.parametrize("output", ["", "sub", "new"])
@pytest.mark.parametrize("verb", ["run", "report"])
def test_closed_folders(verb: str, output: str, home: Path, capsys: Any, monkeypatch: Any) -> None:
    with unprivileged() as place:
        before = everything(place)
        name = place / output / "out.csv" if verb == "run" else place / output
        message = refused((FILES | FOLDERS)[verb], str(name), capsys, monkeypatch)
        assert "permission denied" in message
        assert everything(place) == before
