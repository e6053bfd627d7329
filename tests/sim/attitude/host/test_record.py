"""`boresight monitor --log`: a board's record, replayed bit by bit; the noise of its sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.gateware.attitude.system.interface import INITIAL_STATES, ORDERS, Update
from boresight.gateware.boards.frames import END
from boresight.sim.attitude.board.run import run_board, stimulus
from boresight.sim.attitude.devices import INERTIAL_FAULTS
from boresight.sim.attitude.host.line import Listener, RegisterTable
from boresight.sim.attitude.host.monitor import log_of, static_noise, track_of
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record
from tests.support.attitude.board.shared import MEKF, shared_board
from tests.support.attitude.serial_board import REGISTERS, SerialBoard, frames

#: Of the sensors: lost words, a reset, a gap after which the filter restarts, a garbled line.
_SPANS = (("60 61", "bit_flips"), ("90 90", "reset"), ("170 440", "no_data_ready"))
ADIS = "".join(f"{span} {INERTIAL_FAULTS.index(fault)}\n" for span, fault in _SPANS)
HMR = "1 1 6\n"
UPDATES = 230


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """Folder with what a host hears, and the map of the board."""
    board, folder = shared_board(), tmp_path_factory.mktemp("board")
    what = stimulus(synthetic_log(seconds=2, rate_hz=1024, seed=2, acceleration=0.3), board)
    restart = next(o.mask for o in ORDERS if o.name == "restart_filter")
    run = run_board(
        board,
        what,
        updates=UPDATES,
        settings={"filter": MEKF, "output_divider": 1, "output_mode": 2, "compass_mode": 0},
        faults={"adis": ADIS, "hmr": HMR},
        orders={250_000: INITIAL_STATES.mask, 2_800_000: restart},
    )
    assert run.trace.violations == 0 and len(run.frames) == UPDATES
    (folder / "capture.bin").write_bytes(run.trace.data)
    (folder / "registers.json").write_text(board.system.map().to_json())
    return folder


def differing(log: Path, registers: Path, rows: slice = slice(None)) -> int:
    """Words of the board that the fixed-point model does not have, bit by bit."""
    record = read_record(log)
    outputs = boresight.run("mekf", log, levels="fixed", params=[f"@{registers}"])["outputs"]
    board = {name: record.numbers(f"{name}_true")[rows] for name in outputs}
    return sum(np.count_nonzero(outputs[n][rows] != words) for n, words in board.items())


def test_replay_with_faults(recorded: Path, tmp_path: Path, capsys) -> None:
    """Heard from the middle of a frame on; the record begins with the order of a later update."""
    capture, registers = tmp_path / "late.bin", recorded / "registers.json"
    capture.write_bytes((recorded / "capture.bin").read_bytes()[1000:])
    log = tmp_path / "run.csv"
    assert main(["monitor", str(capture), "--map", str(registers), "--log", str(log), "-q"]) == 0
    record = read_record(log)
    dt, used = record.numbers("dt"), np.isfinite(record.numbers("mx"))
    flags = record.numbers("flags").astype(int) << 16
    first = record.numbers("number")[0]
    assert first > 20 and len(record) == UPDATES + 1 - first
    assert dt[0] == -0.25 and np.count_nonzero(dt < 0) == 3  # and after the gap, and an order
    assert np.count_nonzero(dt > 0.0015) >= 2 and np.count_nonzero(used) >= 2
    assert np.array_equal(used, np.isfinite(record.numbers("compass_heading_deg")))
    assert (flags & 1 << 28).any()  # a stale compass
    assert differing(log, registers) == 0
    (tmp_path / "early.bin").write_bytes((recorded / "capture.bin").read_bytes())
    whole = tmp_path / "whole.parquet"
    boresight.monitor(str(tmp_path / "early.bin"), register_map=registers, log=whole)
    assert np.flatnonzero(read_record(whole).numbers("restart")).tolist() == [first - 1]
    assert differing(whole, registers) == 0
    assert main(["accuracy", "mekf", str(log), "--param", f"@{registers}"]) == 0
    assert "mekf" in capsys.readouterr().out


def test_a_damaged_frame_is_told(recorded: Path, tmp_path: Path, capsys) -> None:
    data = bytearray((recorded / "capture.bin").read_bytes())
    ends = np.flatnonzero(np.frombuffer(bytes(data), np.uint8) == END)
    data[ends[2 * 30] + 20] ^= 1  # the CRC of the 31st frame is wrong then
    (tmp_path / "bad.bin").write_bytes(data)
    log, registers = tmp_path / "bad.parquet", recorded / "registers.json"
    result = boresight.monitor(str(tmp_path / "bad.bin"), register_map=registers, log=log)
    gap = int(np.flatnonzero(np.diff(read_record(log).numbers("number")) != 1)[0]) + 1
    assert (result["missing"], result["bad"]) == (1, 1)
    assert f"missing after row {gap}: replay is exact up to there" in result.notes[-1]
    assert differing(log, registers, slice(0, gap)) == 0


def test_what_cannot_be_recorded(recorded: Path, tmp_path: Path, capsys) -> None:
    capture, registers = tmp_path / "plain.bin", recorded / "registers.json"
    capture.write_bytes(frames(range(9)))
    other = tmp_path / "other.json"
    other.write_text(REGISTERS.to_json())
    for options, message in (
        ([], "--log: wanted the register map of the complete system, found none"),
        (["--map", str(other)], "--log: wanted the register map of the complete system"),
        (["--map", str(registers)], "found 0 of 9 updates with counts, none of them from initial"),
        (["--map", str(registers), "--log", "a.json"], "wanted a suffix of logs"),
    ):
        log = ["--log", str(tmp_path / "no.csv")] if "--log" not in options else []
        assert main(["monitor", str(capture), *options, *log]) == 2
        assert message in capsys.readouterr().err


def identity(registers: Path, *, other: int = 0) -> dict[int, int]:
    """The words by which a board's bitstream is known."""
    table = RegisterTable(registers)
    low, high = (table.find(f"system_build_{part}") for part in ("low", "high"))
    return {low.address: low.reset ^ other, high.address: high.reset}


def test_the_map_of_another_bitstream_is_refused(recorded: Path, tmp_path: Path) -> None:
    registers = recorded / "registers.json"
    with (
        SerialBoard(identity(registers, other=1)) as board,
        pytest.raises(boresight.InputError, match="wanted the map of the board's bitstream, whose"),
    ):
        boresight.monitor(board.port, register_map=registers, log=tmp_path / "no.csv")
    assert board.written == []


def test_a_port_is_told_to_record(recorded: Path, tmp_path: Path) -> None:
    """And to send attitudes alone afterwards, even if the record is refused."""
    registers = recorded / "registers.json"
    words, refused = identity(registers), pytest.raises(boresight.InputError, match="with counts")
    with SerialBoard(words) as board, refused:
        boresight.monitor(
            board.port, steps=3, register_map=registers, log=tmp_path / "no.csv", silence_s=2.0
        )
    table = shared_board().system.map()
    mode, divider, order = (
        table.find(n).address for n in ("output_mode", "output_divider", "order")
    )
    assert board.written == [(divider, 1), (mode, 2), (order, INITIAL_STATES.mask), (mode, 1)]


def test_a_port_s_record_has_the_computer_s_time(recorded: Path, tmp_path: Path) -> None:
    """And is kept when the board falls silent."""
    capture, log = (recorded / "capture.bin").read_bytes(), tmp_path / "port.csv"
    registers = recorded / "registers.json"
    with SerialBoard(identity(registers), capture=capture) as board:
        result = boresight.monitor(board.port, register_map=registers, log=log, silence_s=2.0)
    assert not result.good
    assert result.failures[0].startswith(f"ended after {UPDATES} attitudes: {board.port}: wanted")
    record = read_record(log)
    assert differing(log, registers) == 0
    assert (np.diff(record.numbers("computer")) >= 0.0).all()
    assert record.numbers("computer")[-1] > record.numbers("computer")[0]


def test_a_command_to_the_compass_as_text(recorded: Path, tmp_path: Path, capsys) -> None:
    registers, command = str(recorded / "registers.json"), "compass_command=#Var=-3.5"
    with SerialBoard({}) as board:
        assert main(["monitor", board.port, "--map", registers, "--write", command]) == 0
    sent = bytes(word & 0xFF for _, word in board.written)
    assert sent == b"#Var=-3.5\r\n" and all(word >> 8 == 1 for _, word in board.written)
    assert main(["monitor", "x", "--map", registers, "--write", f"{command}{'0' * 9}"]) == 2
    assert "wanted a command of up to 14 ASCII characters" in capsys.readouterr().err


def test_stamps_begin_anew_after_43_s(recorded: Path) -> None:
    """2^32 cycles of 100 MHz."""
    table, capture = RegisterTable(recorded / "registers.json"), recorded / "capture.bin"
    heard = Listener(table.formats).feed(capture.read_bytes())
    updates = [u for u in heard if isinstance(u, Update)]
    number = track_of(updates, clock_hz=table.clock_hz).number
    late = [replace(u, stamp=(u.stamp - updates[40].stamp) % 2**32) for u in updates]
    plain, wrapped = (log_of("a", us, number, table.described, {})[0] for us in (updates, late))
    assert np.array_equal(plain.numbers("t"), wrapped.numbers("t"))
    assert np.array_equal(plain.numbers("dt"), wrapped.numbers("dt"))


def test_static_noise() -> None:
    """Means and variances of a sensor that warms; the compass has every fourth sample."""
    rng, n = np.random.default_rng(4), 40_000
    t = np.arange(n) / 1024
    sd = {"g": (4e-3, 1e-3, 2e-3), "a": (0.13, 0.11, 0.01), "m": (0.15, 0.45, 0.24)}
    bias, drift = 6e-3, 1e-4
    columns = {"t": t}
    for letter, deviations in sd.items():
        for axis, deviation in zip("xyz", deviations, strict=True):
            columns[letter + axis] = bias + drift * t + rng.normal(0.0, deviation, n)
    for axis in "xyz":
        columns[f"m{axis}"][np.arange(n) % 4 != 0] = np.nan
    noise = static_noise(Record.of(columns))
    for letter, name in (("g", "gyro"), ("a", "accelerometer"), ("m", "magnetometer")):
        mean, variance = noise[name]
        error = 5.0 * np.array(sd[letter]) / np.sqrt(n / 4)
        assert (np.abs(mean - bias - drift * t.mean()) < error).all()
        assert variance == pytest.approx(np.square(sd[letter]), rel=0.06)
