"""`boresight monitor`: captures of the hardware, a port, registers by name, and what goes wrong."""

from __future__ import annotations

import csv
import os
import random
from dataclasses import replace

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.sim import Simulator

import boresight
from boresight.cli import main
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput
from boresight.gateware.attitude.system.csr import Results
from boresight.gateware.attitude.system.interface import FORMATS, OUTPUTS, Update, update_of
from boresight.gateware.boards.frames import Framer, Kind, encode
from boresight.gateware.description import Records, Word
from boresight.sim.attitude.host.monitor import track_of
from tests.support.attitude.serial_board import REGISTERS, SerialBoard, words_of


@pytest.fixture
def registers(tmp_path):
    path = tmp_path / "registers.json"
    path.write_text(REGISTERS.to_json())
    return path


@pytest.fixture
def refused(capsys):
    """Run; expect exit code 2 and one line on stderr, nothing on stdout."""

    def run(*argv) -> str:
        try:
            code = main(["monitor", *map(str, argv)])
        except SystemExit as stop:
            code = stop.code
        out = capsys.readouterr()
        assert code == 2 and out.out == "" and out.err.count("\n") == 1, out
        assert out.err.startswith("error: ")
        return out.err

    return run


def test_capture_of_the_hardware(tmp_path, capsys) -> None:
    """Bytes as the gateware sends them; the third update is lost on the way."""
    results, output, framer = Results(), AttitudeOutput(), Framer()
    top, sent, rng = Module(), [], random.Random(1)
    top.submodules += [results, output, framer]
    wiring.connect(top, output.port, results.ports[0])
    wiring.connect(top, output.o, framer.i)
    updates = [
        words_of(k, 97_656 * k, heading=rng.randrange(-(1 << 31), 1 << 31), filter=0)
        for k in range(1, 9)
    ]

    async def take(ctx):
        ctx.set(framer.o.ready, 1)
        async for _, _, valid, byte in ctx.tick().sample(framer.o.valid, framer.o.payload):
            if valid:
                sent[-1].append(byte)

    async def write(ctx):
        ctx.set(output.on, 1)
        ctx.set(output.last_output, len(OUTPUTS) - 1)
        for words in updates:
            sent.append(bytearray())
            for k, word in enumerate(words):
                ctx.set(results.w_en, 1)
                ctx.set(results.w_index, k if k < 2 else 14 + k)
                ctx.set(results.w_data, word & 0xFFFF_FFFF)
                ctx.set(results.complete, k == 9)
                await ctx.tick()
            ctx.set(results.complete, 0)
            ctx.set(output.updated, 1)
            await ctx.tick()
            ctx.set(output.updated, 0)
            await ctx.tick().repeat(900)

    sim = Simulator(top)
    sim.add_clock(1e-8)
    sim.add_testbench(take, background=True)
    sim.add_testbench(write)
    sim.run()

    capture = tmp_path / "capture.bin"
    capture.write_bytes(b"".join(bytes(s) for k, s in enumerate(sent) if k != 2))
    table, picture = tmp_path / "out.csv", tmp_path / "out.svg"
    assert main(["monitor", str(capture), "-o", str(table), "-o", str(picture)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "7 attitudes, 1 missing, 0 frames damaged"
    exact = [update_of(w, FORMATS[0]) for k, w in enumerate(updates) if k != 2]
    rows = list(csv.DictReader(table.read_text().splitlines()))
    for row, line, attitude in zip(rows, lines, exact, strict=False):
        assert int(row["number"]) == attitude.number and f"{attitude.number:5d}  heading" in line
        for name in ("heading_deg", "pitch_deg", "roll_deg"):
            assert abs(float(row[name]) - attitude.values[name]) <= 1e-6
        assert row["status"] == "0x03" and "field_used" in line
        assert row["time_s"] and row["qw"]
    assert float(rows[-1]["time_s"]) == pytest.approx(7 * 97_656e-8)
    assert "1 missing" in picture.read_text()


def test_port(registers) -> None:
    seen = []
    with SerialBoard({}, noise=b"\x7f") as board:
        data = boresight.monitor(board.port, steps=5, register_map=registers, each=seen.append)
    assert len(data["attitudes"]) == len(seen) == 5
    numbers = [a.number for a in data["attitudes"]]
    assert numbers == list(range(numbers[0], numbers[0] + 40, 8))


def test_registers_by_name(registers, capsys) -> None:
    with SerialBoard({1038: -5 & 0xFFFF, 1296: -(1 << 30), 1033: 0x31, 1041: 0}, deaf=1) as board:
        assert (
            main(
                [
                    "monitor",
                    board.port,
                    "--map",
                    str(registers),
                    "--write",
                    "filter=fast",
                    "--write",
                    "gain=-0.25",
                    "--write",
                    "0x410=1",
                    "--read",
                    "filter",
                    "--read",
                    "temperature",
                    "--read",
                    "result_pitch",
                    "--read",
                    "flags",
                    "--read",
                    "0x411",
                ]
            )
            == 0
        )
        assert board.written == [(1041, 1), (3, -(1 << 28)), (1040, 1)]
    assert capsys.readouterr().out.splitlines() == [
        "filter = 0x00000001 written",
        "gain = 0xf0000000 written",
        "0x410 = 0x00000001 written",
        "filter = fast  (0x00000001)",
        "temperature = -5 0.0678 degC  (0x0000fffb)",
        "result_pitch = -0.5 ht  (0xc0000000)",
        "flags = running 1, rate 3  (0x00000031)",
    ]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--write", "filter"), "--write: wanted NAME=VALUE, found 'filter'"),
        (
            ("--write", "filter=quick"),
            "--write filter: wanted a number or slow or fast, found 'quick'",
        ),
        (("--write", "filter=2"), "--write filter: wanted 0 to 1, found 2"),
        (("--write", "gain=1.5"), "--write gain: wanted -1 to 1, found 1.5"),
        (
            ("--write", "temperature=1"),
            "wanted a register that can be written, found one that can be",
        ),
        (("--read", "gain"), "--read gain: wanted a register that can be read, found one that"),
        (("--read", "gians"), "register gians: wanted a register of"),
        (("--read", "5000"), "wanted an address from 0 to 4095, found '5000'"),
        (("--steps", "0"), "--steps: wanted 1 or more, found 0"),
        (("--baud", "0"), "--baud: wanted 1 to 100,000,000, found 0"),
        (
            ("-o", "out.gif"),
            "--output: wanted a name with .csv, .png, .svg or .pdf, found 'out.gif'",
        ),
        (
            ("-o", "a.csv", "--log", "./a.csv"),
            "found the same file as --output; choose another with",
        ),
        (("--read", "filter"), "wanted a serial port to read or write registers, found a file"),
        (("-o", "out.png"), "wanted frames with attitudes, found none;"),
    ],
)
def test_wrong_use(option, message: str, registers, tmp_path, refused) -> None:
    capture = tmp_path / "capture.bin"
    capture.write_bytes(b"")
    assert message in refused(capture, "--map", registers, *option)


def test_records_of_a_core_that_a_computer_feeds(tmp_path, refused) -> None:
    capture = tmp_path / "capture.bin"
    for word in (32, 24):
        capture.write_bytes(b"\x00\xc0" + 3 * encode(Kind.RECORD, [1, -2], word=word))
        told = refused(capture)
        assert "found 3 records of a core that a computer feeds (--top records); README" in told


def test_no_such_port_map_or_board(tmp_path, registers, refused) -> None:
    assert "wanted a serial port, or a file" in refused(tmp_path / "none")
    assert "wanted a serial port, or a file" in refused(tmp_path)
    assert "and --map registers.json" in refused(tmp_path, "--read", "filter")
    said = refused(tmp_path, "--map", registers, "--write", f"@{registers}")
    assert "fit board writes them, found a register map; give such a file, or write NAME=" in said
    (tmp_path / "bad.json").write_text("[1]")
    assert "wanted a registers.json" in refused(tmp_path, "--map", tmp_path / "bad.json")
    master, slave = os.openpty()
    try:
        with pytest.raises(boresight.InputError, match="found none for 0.2 s; check wiring"):
            boresight.monitor(os.ttyname(slave), silence_s=0.2)
        with pytest.raises(boresight.InputError, match="found none in 3 tries"):
            boresight.monitor(os.ttyname(slave), reads=["0x400"])
    finally:
        os.close(master)
        os.close(slave)


def test_track() -> None:
    def at(number: int, stamp: int) -> Update:
        return update_of(words_of(number, stamp), FORMATS[0])

    track = track_of(
        [at(65_528, 2**32 - 500), at(0, 500), at(8, 1500), at(32, 4500), at(40, 5500)], clock_hz=1e3
    )
    assert track.number == (65_528, 65_536, 65_544, 65_568, 65_576)
    assert track.time_s == (0.0, 1.0, 2.0, 5.0, 6.0)
    assert track.gaps == ((2, 2),) and track.missing == 2
    assert track_of([], clock_hz=1.0).missing == 0


def test_outputs_of_another_estimator(tmp_path, capsys) -> None:
    """By the names and formats of the map; attitudes of a filter beside it stay attitudes."""
    programs = (
        Records("mekf", "", (), tuple(Word(name, 30) for name in OUTPUTS)),
        Records("pointing", "", (), (Word("azimuth", 31), Word("rate", 20))),
    )
    path = tmp_path / "registers.json"
    path.write_text(replace(REGISTERS, programs=programs).to_json())
    capture = tmp_path / "capture.bin"
    made = [[k | 1 << 16, 100_000 * k, -(1 << 30) + k, 3 << 19] for k in range(1, 6)]
    capture.write_bytes(b"\xc0" + b"".join(encode(Kind.ATTITUDE, w, word=32) for w in made))
    data = boresight.monitor(str(capture), register_map=path, output=[tmp_path / "out.csv"])
    assert data["bad"] == data["missing"] == 0 and len(data["attitudes"]) == 5
    assert data["attitudes"][1].values == {"azimuth": -0.5 + 2 / 2**31, "rate": 1.5}
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
    assert list(rows[0]) == ["number", "time_s", "azimuth", "rate", "flags"]
    assert [float(row["time_s"]) for row in rows] == [0.0, 0.002, 0.004, 0.006, 0.008]
    assert main(["monitor", str(capture), "--map", str(path)]) == 0
    assert "    2  azimuth -0.5  rate +1.5" in capsys.readouterr().out
    with pytest.raises(
        boresight.InputError, match="--output: wanted attitudes, found other outputs"
    ):
        boresight.monitor(str(capture), register_map=path, output=[tmp_path / "out.png"])
    # Without the map the words have no names and units.
    with pytest.raises(boresight.InputError, match="wanted frames with attitudes"):
        boresight.monitor(str(capture))
    mixed = [words_of(6, 600_000, filter=0), [7 | 1 << 16, 700_000, 0, 0]]
    capture.write_bytes(b"\xc0" + b"".join(encode(Kind.ATTITUDE, w, word=32) for w in mixed))
    boresight.monitor(str(capture), register_map=path, output=[tmp_path / "both.csv"])
    first, second = csv.DictReader((tmp_path / "both.csv").read_text().splitlines())
    assert first["heading_deg"] and not first["azimuth"]
    assert second["azimuth"] and not second["heading_deg"]
