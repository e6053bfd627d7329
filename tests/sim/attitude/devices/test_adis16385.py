"""The inertial sensor's model by itself: a scripted master at its pins, good and bad."""

import pytest

from boresight.sim.attitude.devices.adis16385 import FAULTS, device_text
from boresight.sim.rtl.compiled import Compiled, build
from tests.support.attitude.devices.adis16385_bench import log_text

#: Drives frames as told: lines `half setup stall bits word`; prints what comes back.
MASTER = """
module master(input clk, input rst);
    reg cs_n, sclk, din, rst_n;
    reg [2:0] wait_reset;
    wire dout, dio1, log_done;
    wire [31:0] line, instants, frames, violations;
    reg [15:0] fault;
    integer file, got, half, setup, stall, bits, timer, count, start, now, reset_at;
    reg [15:0] word, back, sent;
    reg [1:0] state;
    reg dio1_before;
    adis16385_device #(.CLOCK_HZ(1_000_000), .RATE_HZ(500), .STARTUP(200), .READY_PULSE(50),
        .STALL_MIN(30), .HALF_MIN(5), .SETUP_MIN(4), .RESET_MIN(20), .DOUT_DELAY(2)) device (
        .clk(clk), .cs_n(cs_n), .sclk(sclk), .din(din), .dout(dout), .dio1(dio1), .rst_n(rst_n),
        .hold_log(1'b0), .fault(fault), .log_done(log_done), .line(line), .instants(instants),
        .frames(frames), .violations(violations));
    initial begin
        cs_n = 1; sclk = 1; din = 0; rst_n = 0; state = 0; timer = 0; count = 0; now = 0;
        back = 0; dio1_before = 0;
        if (!$value$plusargs("start=%d", start)) start = 300;
        if (!$value$plusargs("fault=%h", fault)) fault = 0;
        if (!$value$plusargs("reset_at=%d", reset_at)) reset_at = -100;
        file = $fopen("frames.txt", "r");
    end
    always @(posedge clk) if (!rst) begin
        now <= now + 1;
        rst_n <= now >= 30 && !(now >= reset_at && now < reset_at + 30);
        dio1_before <= dio1;
        if (dio1 && !dio1_before) $display("ready %0d %0d", now, line);
        timer <= timer + 1;
        case (state)
            0: if (now >= start) begin
                got = $fscanf(file, "%d %d %d %d %h", half, setup, stall, bits, word);
                if (got != 5) begin
                    if (timer > 20) begin
                        $display("end %0d %0d %0d", frames, violations, log_done);
                        $finish;
                    end
                end else begin
                    state <= 1; timer <= 1;
                end
            end
            1: if (timer >= stall) begin
                cs_n <= 0; timer <= 1; state <= 2; count <= 0; sent <= word;
            end
            2: if (timer >= (count == 0 ? setup : half)) begin
                timer <= 1;
                if (count == 2 * bits) begin
                    cs_n <= 1; state <= 0;
                    $display("frame %0d %h %h", now, word, back);
                end else begin
                    sclk <= ~sclk;
                    if (sclk) begin
                        din <= sent[15]; sent <= sent << 1;
                    end else back <= {back[14:0], dout};
                    count <= count + 1;
                end
            end
            default: state <= 0;
        endcase
    end
endmodule
"""

GOOD = (5, 4, 40, 16)


@pytest.fixture(scope="module")
def master() -> Compiled:
    return build("master", {"device.sv": device_text(), "master.sv": MASTER})


def run(
    master: Compiled, frames: list[tuple[int, ...]], *, log=(), fault: str = "", **plusargs: int
) -> tuple[list[int], list[str], list[str]]:
    """Answers, complaints, all lines."""
    lines = "".join(
        f"{half} {setup} {stall} {bits} {word:04x}\n" for half, setup, stall, bits, word in frames
    )
    values = {"adis_log": "log.txt", "adis_faults": "faults.txt", **plusargs}
    if fault:
        values["fault"] = f"{1 << FAULTS.index(fault):x}"
    done = master.run(
        values,
        max_cycles=200_000,
        files={"frames.txt": lines, "log.txt": log_text(log), "faults.txt": ""},
    )
    out = [line for line in done.stdout.splitlines() if not line.startswith("- ")]
    answers = [int(line.split()[3], 16) for line in out if line.startswith("frame")]
    return answers, [line for line in out if "violation:" in line], out


def read(address: int) -> tuple[int, ...]:
    return (*GOOD, address << 8)


def test_pipeline_defaults_and_writes(master: Compiled) -> None:
    commands = [
        read(0x56),
        read(0x34),
        read(0x36),
        read(0x38),
        (*GOOD, 0xB902),
        (*GOOD, 0xB801),
        read(0x38),
        (*GOOD, 0xB5FF),
        read(0x34),
        read(0x02),
        read(0x00),
    ]
    answers, complaints, out = run(master, commands)
    assert not complaints
    # The frame after a command brings its answer; eleven bits of MSC_CTRL exist.
    assert answers[1:5] == [0x4001, 0x0006, 0x0001, 0x0402]
    assert answers[7] == 0x0201 and answers[9] == 0x0706 and answers[10] == 0
    assert out[-1].startswith("end 11 0 ")


@pytest.mark.parametrize(
    "frame, complaint",
    [
        ((4, 4, 40, 16, 0x5600), "half period: 4, wanted 5"),
        ((5, 3, 40, 16, 0x5600), "short setup: 3, wanted 4"),
        ((5, 4, 20, 16, 0x5600), "short stall: 2"),
        ((5, 4, 40, 15, 0x5600), "bits in a frame: 15, wanted 16"),
        ((5, 4, 40, 17, 0x5600), "bits in a frame: 17, wanted 16"),
        ((5, 4, 40, 16, 0x8412), "write to a register that is read-only: 4, wanted 0"),
        ((5, 4, 40, 16, 0xD612), "write to a register that is read-only: 86, wanted 0"),
    ],
)
def test_rules_of_timing(master: Compiled, frame: tuple[int, ...], complaint: str) -> None:
    _, complaints, out = run(master, [read(0x56), frame, read(0x3C), read(0x56)])
    assert complaints and all(complaint in line for line in complaints)
    assert int(out[-1].split()[2]) == len(complaints)


def test_wrong_number_of_bits_shows_in_diag_stat_once(master: Compiled) -> None:
    commands = [read(0x56), (5, 4, 40, 12, 0), read(0x3C), read(0x3C), read(0x3C)]
    answers, _, _ = run(master, commands)
    assert answers[-2:] == [0x0008, 0]


def test_reset_forgets(master: Compiled) -> None:
    commands = [(*GOOD, 0xB902), *[read(0x38)] * 12]
    answers, _, _ = run(master, commands, reset_at=1000)
    assert answers[2] == 0x0202 and answers[-1] == 0x0402
    assert 0 in answers  # dead meanwhile


def test_samples_come_from_the_log(master: Compiled) -> None:
    log = [[-1, 2, -3, 4, -5, 6, -7, 0], [100, 2, 3, 4, 5, 32767, 7, 0x10]]
    commands = [read(address) for address in (0x04, 0x06, 0x08, 0x0A, 0x0C, 0x0E, 0x10, 0x3C)]
    words = {}
    for start, line in ((300, 1), (2300, 2), (6300, 2)):
        answers, _, out = run(master, [*commands, read(0x56)], log=log, start=start)
        words[start] = answers[1:]
        edges = [text.split() for text in out if text.startswith("ready")]
        assert int(edges[-1][2]) == line
        errors = [int(b[1]) - int(a[1]) for a, b in zip(edges, edges[1:], strict=False)]
        assert set(errors) <= {2000}
        assert out[-1].split()[3] == str(int(start > 4000))
    # Bits 15 to 12 of the temperature are no data.
    assert words[300] == [0xFFFF, 2, 0xFFFD, 4, 0xFFFB, 6, 0x8FF9, 0]
    assert words[2300] == [100, 2, 3, 4, 5, 0x7FFF, 0x8007, 0x10]
    assert words[6300] == words[2300]  # the last line stays


@pytest.mark.parametrize(
    "fault, answers",
    [
        ("", [0x4001, 0x0402, 0]),
        ("wrong_identity", [0x4000, 0x0402, 0]),
        ("absent", [0xFFFF] * 3),
        ("stuck_high", [0xFFFF] * 3),
        ("stuck_low", [0] * 3),
        ("alarm", [0x4001, 0x0402, 0x0300]),
        ("over_range", [0x4001, 0x0402, 0x0010]),
        ("link_failure", [0x4001, 0x0402, 0x0008]),
    ],
)
def test_faults(master: Compiled, fault: str, answers: list[int]) -> None:
    frames = [read(0x56), read(0x38), read(0x3C), read(0x00)]
    assert run(master, frames, fault=fault)[0][1:] == answers


def test_bit_flips_change_one_bit_of_each_answer(master: Compiled) -> None:
    answers, _, _ = run(master, [read(0x56)] * 10, fault="bit_flips")
    assert all((answer ^ 0x4001).bit_count() == 1 for answer in answers[1:])


def test_fast_and_missing_data_ready(master: Compiled) -> None:
    counts = {}
    for fault in ("", "fast_data_ready", "no_data_ready", "absent"):
        _, _, out = run(master, [read(0x56)], start=9000, fault=fault)
        counts[fault] = sum(text.startswith("ready") for text in out)
    assert counts[""] == 5 and counts["no_data_ready"] == counts["absent"] == 0
    assert 8 * 4 < counts["fast_data_ready"] <= 8 * 5
