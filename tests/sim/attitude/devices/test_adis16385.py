"""The inertial sensor's model by itself: a scripted master at its pins that breaks its rules.

What the model measures and its faults are compared in the tests of the reader.
"""

import pytest

from boresight.sim.attitude.devices import INERTIAL_FAULTS, device_text
from boresight.sim.rtl.simulators import Compiled, build
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
    return build("master", {"device.sv": device_text("adis16385"), "master.sv": MASTER})


def run(
    master: Compiled, frames: list[tuple[int, ...]], *, log=(), fault: str = "", **plusargs: int
) -> tuple[list[int], list[str], list[str]]:
    """Answers, complaints, all lines."""
    lines = "".join(
        f"{half} {setup} {stall} {bits} {word:04x}\n" for half, setup, stall, bits, word in frames
    )
    values = {"adis_log": "log.txt", "adis_faults": "faults.txt", **plusargs}
    if fault:
        values["fault"] = f"{1 << INERTIAL_FAULTS.index(fault):x}"
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
