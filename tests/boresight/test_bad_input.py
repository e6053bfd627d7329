"""Mistakes that people made: each gives one clear line, exit code 2, and leaves nothing behind."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.model.attitude import ESTIMATORS
from boresight.model.errors import InputError, shortened
from boresight.sim.records.bundled import bundled
from tests.support.bad_files import changed
from tests.support.estimators import ALL
from tests.support.tree import ROOT

pytestmark = pytest.mark.pythons

HEADER = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n"
ROWS = "".join(f"{k / 100},0.01,0.02,0.03,0.1,0.2,9.8,1,20,-40\n" for k in range(20))
TRUTH = (HEADER + ROWS).replace("mz\n", "mz,qw,qx,qy,qz\n").replace("-40\n", "-40,1,0,0,0\n")


@pytest.fixture
def refused(tmp_path, capsys, monkeypatch):
    """A function that runs a command line in a folder of files, and gives its one line."""
    monkeypatch.chdir(tmp_path)
    for name, content in {
        "log.csv": HEADER + ROWS,
        "truth.csv": TRUTH,
        "digits.json": '{"kp_roll_per_s": ' + "9" * 400 + "}",
        "text.txt": "hello\nworld\n" * 40,
        "zeros.bin": "\0" * 4000,
        "noise.bin": "".join(chr(k * 7919 % 128) for k in range(4000)),
        "empty.bin": "",
        "other.json": '{"a": 1}',
        "short.csv": "t,z\n0,1\n1,2\n",
        "text.csv": "t,z\n0,1\nx,1\n",
        "file": "",
    }.items():
        (tmp_path / name).write_text(content)
    (tmp_path / "folder").mkdir()

    def everything() -> dict[str, bytes | None]:
        return {str(p): p.read_bytes() if p.is_file() else None for p in tmp_path.rglob("*")}

    def run(line: str) -> str:
        before = everything()
        try:
            code = main(line.split())
        except SystemExit as stop:
            code = stop.code
        said = capsys.readouterr()
        assert code == 2, said
        assert bool(said.out) is ("--json" in line)
        assert said.err.startswith("error: ") and said.err.count("\n") == 1
        assert everything() == before
        return str(said.err)

    return run


SUPPORT = ROOT / "tests" / "support"
SYSTEMS = f"{ROOT}/systems/mls/"
DRAWS = f"montecarlo {SUPPORT}/drift.py:Constant {SUPPORT}/drift.py:Mean -o x"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("run mekf log.csv --steps 0", "steps: wanted 1 or more, found 0"),
        ("run mekf log.csv --steps -1", "steps: wanted 1 or more, found -1"),
        ("run mekf log.csv --steps x", "--steps: wanted a whole number, found 'x'"),
        (
            "run mekf log.csv --config huge",
            "config: wanted one of small, fast, small-1024, fast-1024, small-2048, fast-2048, ",
        ),
        ("run mekf log.csv -o -", "-o: wanted the name of a file or folder, found '-'; write"),
        ("check log.csv mekf", "found 'log.csv'; the estimator comes first, logs after it"),
        ("", "wanted a verb: new, list, compile"),
        ("run mekf /dev/zero", "/dev/zero: wanted a log file that can be read, found a device"),
        ("run mekf folder", "folder: wanted a log file that can be read, found a folder"),
        ("run mekf text.txt/x", "wanted a log file that can be read, found not a directory"),
        ("compile mekf -o x --urgent 0", "urgent: wanted 1 to 8, found 0"),
        ("compile mekf -o x --urgent -3", "urgent: wanted 1 to 8, found -3"),
        ("compile mekf -o x --urgent 99", "urgent: wanted 1 to 8, found 99"),
        ("compile mekf -o x --config nosuch", "config: wanted one of small, fast"),
        ("compile mekf -o x --board mimas --word 25", "system: wanted 26 to 32, found 25"),
        ("compile mekf -o x --word 33", "word: wanted 18 to 32 bits, found 33"),
        ("compile complementary -o x --params digits.json", "found a number of 400 digits"),
        ("check mekf log.csv --levels fixed --config medium", "config: wanted one of small, fast"),
        ("check mekf log.csv --levels c --simulator vcs", "wanted one of verilator, icarus"),
        ("check mekf log.csv --levels c,d", "levels: wanted one of fixed, c, rtl, netlist"),
        (
            "check mekf log.csv --tolerance roll=",
            "--tolerance: wanted OUTPUT=NUMBER, 0 or more, with or witho",
        ),
        ("check mekf log.csv --tolerance roll=-1", "write for example --tolerance pitch=0.05ht\n"),
        (
            "check mekf log.csv --tolerance rol=1",
            "an output of mekf: pitch, roll, heading, qw, qx, qy, qz, ",
        ),
        ("--on c run mekf log.csv", "wanted a verb, found --on; its options follow it"),
        ("-q --json run mekf none.csv", "none.csv: wanted a log file that can be read"),
        ("run mekf log.csv --urgent", "found --urgent; leave it out; see boresight run --help"),
        ("run mekf log.csv --wrd 20", "found --wrd 20; write --word; see boresight run --help"),
        ("check mekf log.csv --tolerance roll=1m", "--tolerance roll=1m: wanted a unit of roll, "),
        ("run mekf log.csv --param=--", "--param: wanted a value, found none; "),
        ("run mekf log.csv x\x1by", "run: wanted what this verb takes, found x\\x1by; "),
        (
            "check mekf log.csv --reproducer folder",
            "folder: wanted a path that can be written, found a folder; choose another with",
        ),
        ("check replay log.csv", "log.csv: wanted a reproducer of `boresight check`, found no JS"),
        ("check replay other.json", "other.json: wanted a reproducer of `boresight check`, found "),
        ("check replay folder", "wanted a reproducer of `boresight check` that can be read"),
        ("check replay other.json --config huge", "--config: wanted an estimator and a log"),
        ("check replay other.json --reproducer x", "--reproducer: wanted an estimator and a log"),
        ("simulate f.py:A f.py:B --seconds 2", "--seconds: wanted the simulation of the board, fo"),
        ("simulate kalman --faults", "filter: wanted one of complementary, "),
        ("simulate mekf a.csv --faults", "--faults: wanted no log: "),
        ("simulate --faults --feed a=1", "--feed: wanted the simulation of the board, found tria"),
        ("simulate mekf --jobs 2", "--jobs: wanted --faults, found none; leave --jobs out"),
        ("simulate --faults --output x", "--output: wanted the simulation of the board, found tr"),
        ("report mekf log.csv -o x --steps 0", "steps: wanted 1 or more, found 0"),
        ("report mekf log.csv -o x --config huge", "config: wanted one of small, fast"),
        ("tune mekf truth.csv --folds 5", "folds: wanted 1, for none, as there is one trial"),
        ("tune mekf truth.csv --jobs 0", "jobs: wanted 1 to 1,024, found 0"),
        ("tune mekf truth.csv --word 17", "word: wanted 18 to 32 bits, found 17"),
        ("accuracy mekf truth.csv -o x --word 17", "word: wanted 18 to 32 bits, found 17"),
        (
            "accuracy mekf " + "n" * 300,
            "wanted a log file that can be read, found file name too long",
        ),
        ("experiment ma2014 --seed -1 -o x", "seed: wanted 0 to 2,147,483,648, found -1"),
        ("demo --steps 0 -o x", "steps: wanted 1 or more, found 0"),
        ("bench --updates 99999999999", "updates: wanted 1 to 100,000,000"),
        ("covariance mekf complementary", "complementary: wanted states that are a covariance"),
        ("monitor noise.bin", "noise.bin: wanted attitudes, in frames or lines of text, found "),
        ("monitor zeros.bin", "wanted attitudes, in frames or lines of text, found none, and 14"),
        ("monitor text.txt --json", "wanted attitudes, in frames or lines of text, found none"),
        ("monitor empty.bin -q", "wanted attitudes, in frames or lines of text, found none;"),
        ("monitor text.txt --map other.json", "other.json, name: wanted a registers.json of"),
        ("monitor /dev/null", "/dev/null: wanted a serial port, or a file of captured bytes, "),
        (
            "simulate --config nosuch -o x",
            "config: wanted one of small, fast, small-1024, fast-1024, small-2048, fast-2048, ",
        ),
        ("simulate mekf --word 30 -o x", "--word: wanted a world before it, found the simula"),
        ("simulate mekf --param a=1 -o x", "--param: wanted a world before it, found the simulat"),
        ("simulate --steps 5 -o x", "--steps: wanted a world before it, found the simulation"),
        (
            "simulate --faults --config nosuch",
            "config: wanted one of small, fast, small-1024, fast-1024, small-2048, fast-2048, ",
        ),
        ("simulate --faults --seed 3", "--seed: wanted a world, found trials of faults; leave -"),
        ("simulate --faults --feed a=1", "--feed: wanted the simulation of the board, found tri"),
        ("simulate --faults --seconds nan", "seconds: wanted 0.05 to 20, found nan"),
        # what is run, and on what
        ("fly", "wanted a verb such as "),
        ("check complementary", "wanted LOG, found none; see boresight check --"),
        ("check mekf log.csv --tolerance qw=1deg", "wanted a unit of qw, a plain number, found d"),
        ("check mekf log.csv --target ecp5-25k", "target: wanted the level netlist, which runs "),
        ("check mekf log.csv --levels netlist --target gw2a", " names, nearest: gw2a-18, "),
        ("run kalman log.csv", "boresight list"),
        ("run none.py log.csv", "none.py: wanted a Python file with an estimator, found "),
        ("check complementary absent.csv", "absent.csv: wanted a log file that can be read, found"),
        ("run mekf text.csv", "text.csv, line 3, column t: wanted a finite number, found 'x'; cor"),
        ("run mekf short.csv", "short.csv: wanted columns gx [rad/s], gy [rad/s], "),
        ("run mekf log.csv --onn fixed", "found --onn fixed; write --on; see boresight run --help"),
        ("run mekf log.csv kp=3", "found kp=3; write a parameter as --param kp=3; see boresight "),
        ("run mekf log.csv --on", "--on: wanted a value, found none; see boresight run --help"),
        ("run mekf log.csv --on gpu", "on: wanted one of numpy, float, fixed, c, rtl, netlist"),
        ("run complementary log.csv --param kp_pitch_per_s=33", "kp_pitch_per_s: wanted 0 to 32"),
        ("run complementary log.csv --param kp=x", "--param: wanted NAME=NUMBER, found 'kp=x'"),
        ("check complementary log.csv --allow cycles", "for example --allow cycles=0.01\n"),
        ("run mekf log.csv --word 33", "word: wanted 18 to 32 bits, found 33; "),
        ("run mekf log.csv -o log.csv", "error: log.csv: wanted "),
        ("run mekf log.csv -q -o file/out.csv", "file"),
        ("compile complementary complementary -o x", "complementary"),
        ("compile complementary -o file", "found a file 'file' where a folder must be"),
        ("compile complementary -o x --board arty", "board: wanted one of mimas"),
        ("compile complementary -o x --target ecp5", "target: wanted "),
        ("compile mekf -o x --board ulx3s --target xc6slx9", "target: wanted ecp5-85k, the part"),
        ("compile mekf -o x --board mimas --clock 120", "clock: wanted a design that is routed"),
        ("compile mekf -o x --board icebreaker", "ice40-up5k of icebreaker; add --top records"),
        ("compile complementary -o x --target generic --board mimas", "target: wanted "),
        ("compile complementary -o x --word 17", "word: wanted 18 to 32 bits, found 17"),
        ("compile array_phases -o x --param spacing=0", "spacing: wanted 0.1 to 1"),
        (f"compile {SYSTEMS}phases.py:ArrayPhases(elements=500) -o x", "elements: wanted 2 to 160"),
        (f"compile {SYSTEMS}estimator.py:MlsAttitude(picard=2) -o x", "picard: wanted one of 3"),
        ("convert broat . -o x", "broat"),
        ("convert broad nowhere -o x", "nowhere"),
        ("covariance complementary", "states that are a covariance, named p00, p01, p11"),
        ("covariance ekf_quaternion --updates 0", "updates: wanted 1 to "),
        ("covariance ekf_quaternion --log none.csv", "none.csv: wanted a log file that can be rea"),
        ("experiment ma2015", "wanted file.py:Class, or one of array, battery, "),
        ("experiment ma2014 --runs 1 -o x", "runs: wanted "),
        ("experiment ma2014 -o file", "found a file 'file' where a folder must be"),
        (f"{DRAWS} --runs 1", "runs: wanted 2 to 1,000,000, found 1"),
        (f"{DRAWS} --on rtl", "on: wanted one of c, fixed, float"),
        (f"{DRAWS} --jobs 0", "jobs: wanted 1 to"),
        (f"{DRAWS} --steps 0", "steps: wanted 1 or more"),
        (f"{DRAWS} --param p9=1", "parameter p9"),
        ("simulate kalman -o x", " names, nearest: satcom, "),
        ("simulate mekf --source gps -o x", "source: wanted one of counts, heading, found 'gps'"),
        ("simulate mekf --seconds 0 -o x", "seconds: wanted 0.05 to 20, found 0"),
        ("simulate mekf --seconds nan -o x", "seconds: wanted 0.05 to 20, found nan"),
        (
            f"simulate mekf {bundled('ximu_walk')} --seconds 13 -o x",
            "log 'ximu_walk': wanted 13312 rows or more, found 12625; give a longer log",
        ),
    ],
)
def test_mistakes(line: str, message: str, refused) -> None:
    assert message in refused(line)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ((HEADER + ROWS).replace("gz", "gq"), "a column gz [rad/s]"),
        ((HEADER + ROWS).replace(",mz\n", "\n").replace(",-40\n", "\n"), "a column mz [uT]"),
        (HEADER + ROWS.replace("0.05,", "zero,"), "zero"),
        (HEADER + ROWS.replace("9.8", "nan"), "line 2, column az: wanted a number, found no value"),
        (HEADER + "1" + ROWS, "a time above 1"),
        (HEADER, "row"),
        ("", "empty"),
    ],
)
def test_bad_logs(text: str, message: str, refused, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text(text)
    error = refused("run complementary bad.csv -o out.csv")
    assert message in error and "bad.csv" in error


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("check mekf none.csv", {"where": "none.csv", "found": "no such file or directory"}),
        ("compile mekf --word 99 -o x", {"where": "word", "wanted": "18 to 32 bits"}),
    ],
)
def test_an_error_is_an_object_for_programs(line, parts, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*line.split(), "--json"]) == 2
    said = capsys.readouterr()
    error = json.loads(said.out)["error"]
    assert parts.items() <= error.items() and error["fix"]
    assert said.err == f"error: {error['message']}\n"


def test_programs_that_do_not_fit_leave_no_folder(refused) -> None:
    line = f"compile {' '.join(ALL)} -o x --word 32"
    assert re.search(r": \d{3} states, the small machine has room for 128", refused(line))


def test_messages_stay_short_and_printable(refused) -> None:
    line = refused("run mekf " + "n" * 3000 + "/\x1b[31m.csv")
    assert "n/\\x1b[31m.csv: wanted a log" in line and "..." in line
    assert len(refused("run mekf log.csv --config " + "x" * 5000)) < 400
    assert len(refused("run mekf log.csv --steps " + "9" * 5000)) < 400
    assert shortened("abcdefghijkl", 12) == "abcdefghijkl"
    assert shortened("abcdefghijklm", 12) == "abc...hijklm"
    assert str(InputError("a\tb\n\x07 é\udcff")) == "a b \\x07 é\\udcff"


def test_a_name_in_other_bytes_is_no_obstacle(tmp_path, capsys) -> None:
    log = tmp_path / "l\udcffg.csv"
    log.write_text(HEADER + ROWS)
    assert main(["run", "mekf", str(log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["log"] == "l\ufffdg"


def test_what_published_filters_cannot_take_is_no_bug(refused, tmp_path) -> None:
    still = TRUTH.replace("0.1,0.2,9.8", "0,0,0")
    (tmp_path / "log.csv").write_text(still)
    line = refused("accuracy ahrs_ekf log.csv --jobs 1 -q")
    assert "log.csv: wanted samples that the published filter ahrs_ekf takes, found " in line


def test_a_reference_beyond_all_bounds(refused, tmp_path) -> None:
    (tmp_path / "log.csv").write_text(TRUTH.replace(",1,0,0,0", ",1e300,0,0,0"))
    assert "line 2, column qw: wanted a quaternion of norm 1, found norm" in refused(
        "run mekf log.csv"
    )


def test_a_reproducer_is_checked_as_a_whole(tmp_path: Path, refused) -> None:
    program = json.loads(ESTIMATORS["complementary"]().compile(word=18).to_json())
    good = {
        "boresight_reproducer": 1,
        "config": "small",
        "inputs": [[0] * len(program["inputs"])],
        "outputs": [[0] * len(program["outputs"])],
        "program": program,
    }
    file = tmp_path / "other.json"
    for path, message in (
        (("inputs", [[0]]), "no record of 10 words in inputs"),
        (("inputs", 0, 0, 2**17), "no record of 10 words in inputs"),
        (("outputs", 0, 0, True), "no record of 8 words in outputs"),
        (("config", ["small"]), "the config a list"),
        (("program", None), "a program that lacks something"),
        (("program", "values", 0, "initial", 2**30), "words must be -131072 to 131071"),
    ):
        file.write_text(json.dumps(changed(good, *path)))
        assert message in refused("check replay other.json")
