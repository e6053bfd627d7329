"""The processor itself, in Verilator, on programs that need no compiler."""

from collections.abc import Callable

import pytest

from boresight.gateware.attitude.soc.layout import CONTROL, CONTROL_BASE, KICK, SLOT_BASE
from boresight.sim.attitude.soc.measure import soc_bench
from boresight.sim.rtl.compiled import Compiled
from tests.support.attitude.rv32 import assemble, image

STATUS, CONSOLE, WATCHDOG, ALARM, TIMER, FENCE = (
    4 * [r.name for r in CONTROL].index(name)
    for name in ("status", "console", "watchdog", "alarm", "timer", "fence")
)
#: x30: control block; x31: the bench; ``say REGISTER`` prints a word, ``end`` ends.
HEAD = f"li x30 {CONTROL_BASE:#x}\nli x31 {SLOT_BASE:#x}\n"
SAY, END = "sw {} 64(x31)\n", "sw x30 8(x31)\nstop:\nj stop\n"
MTVEC, MIE, MIP, MSTATUS, MEPC, MCAUSE = 0x305, 0x304, 0x344, 0x300, 0x341, 0x342
IRQ_MASK, IRQ_PENDING = 0xBC0, 0xFC0


@pytest.fixture(scope="module")
def bench() -> Compiled:
    return soc_bench()


@pytest.fixture
def run(bench: Compiled) -> Callable[..., dict[str, list[int]]]:
    """What the bench prints while a program runs: words by the letter of their line."""

    def go(text: str, **arguments: object) -> dict[str, list[int]]:
        words = assemble(HEAD + text)
        done = bench.run(
            arguments,
            max_cycles=8_000_000,
            files={"firmware.hex": image(words), "records.hex": "0000002a\n"},
        )
        said: dict[str, list[int]] = {kind: [] for kind in "OTWID"}
        for line in done.stdout.splitlines():
            if line[:2] in ("O ", "T ", "W ", "I ", "D "):
                said[line[0]].append(int(line[2:], 16 if line[0] == "O" else 10))
        return said

    return go


def say(*registers: str) -> str:
    return "".join(SAY.format(register) for register in registers)


def test_bytes_halves_words(run) -> None:
    text = """
        li x1 0x2000
        li x2 0x11223344
        sw x2 0(x1)
        sw x2 4(x1)
        li x2 0xAABBCCDD
        sb x2 1(x1)
        sh x2 6(x1)
        lw x3 0(x1)
        lw x4 4(x1)
        lb x5 1(x1)
        lbu x6 1(x1)
        lh x7 6(x1)
        lhu x8 6(x1)
    """
    said = run(text + say(*(f"x{k}" for k in range(3, 9))) + END)
    assert said["O"] == [0x1122DD44, 0xCCDD3344, 0xFFFFFFDD, 0xDD, 0xFFFFCCDD, 0xCCDD]


def test_memory_larger_than_the_cache(run) -> None:
    """16 KB written and read back, then with the data cache forgotten."""
    again = """
        li x1 0x4000
        li x2 0x8000
        li x4 0
    again{0}:
        lw x3 0(x1)
        sub x3 x3 x1
        beq x3 x0 right{0}
        addi x4 x4 1
    right{0}:
        addi x1 x1 4
        bltu x1 x2 again{0}
    """
    text = """
        li x1 0x4000
        li x2 0x8000
    fill:
        sw x1 0(x1)
        addi x1 x1 4
        bltu x1 x2 fill
    """
    text += again.format(0) + say("x4") + ".word 0x500F\n" + again.format(1) + say("x4", "x1")
    assert run(text + END)["O"] == [0, 0, 0x8000]


def test_an_address_without_a_part(run) -> None:
    text = ""
    for address in (0x80001000, 0xFFFFFFF0, 0x00100000):
        text += f"""
            lw x2 {STATUS}(x30)
            sw x2 {STATUS}(x30)
            li x1 {address:#x}
            lw x3 0(x1)
            lw x4 {STATUS}(x30)
            andi x4 x4 8
        """ + say("x3", "x4")
    assert run(text + END)["O"] == [0, 8] * 3


def test_code_below_the_fence_is_not_written(run) -> None:
    text = f"""
        li x1 0x20
        lw x2 0(x1)
        li x3 1
        sw x3 {FENCE}(x30)
        sw x0 0(x1)
        .word 0x500F
        lw x4 0(x1)
        sub x4 x4 x2
        lw x5 {STATUS}(x30)
        andi x5 x5 8
    """
    assert run(text + say("x4", "x5") + END)["O"] == [0, 8]


def trap(body: str, handler: str) -> str:
    """``body`` with ``handler`` as the entry of every trap; it ends the program."""
    return f"li x1 trap\ncsrw {MTVEC:#x} x1\n{body}wait:\nj wait\ntrap:\n{handler}{END}"


def test_device_and_console_interrupts(run) -> None:
    """Bit 11 of mie lets them in; the mask chooses; what is masked does not come."""
    enable = f"li x2 0x800\ncsrs {MIE:#x} x2\nli x2 8\ncsrs {MSTATUS:#x} x2\n"
    handler = f"csrr x3 {MCAUSE:#x}\ncsrr x4 {IRQ_PENDING:#x}\n" + say("x3", "x4")
    external = 0x8000000B
    for mask, words, options in (
        (1, [external, 1], {"records": 1, "words": 1, "gap": 500}),
        (2, [external, 2], {"keys": "41", "keys_at": 500}),
    ):
        body = f"li x2 {mask}\ncsrw {IRQ_MASK:#x} x2\n" + enable
        assert run(trap(body, handler), **options)["O"] == words
    masked = f"li x2 2\ncsrw {IRQ_MASK:#x} x2\n" + enable
    options = {"records": 1, "words": 1, "gap": 500, "limit": 5000}
    assert run(trap(masked, handler), **options)["O"] == []


def test_timer_interrupt_and_return(run) -> None:
    """Taken once the alarm is due; mret goes on where it was."""
    text = f"""
        li x1 trap
        csrw {MTVEC:#x} x1
        lw x2 0(x30)
        addi x2 x2 500
        sw x2 {ALARM}(x30)
        li x3 1
        sw x3 {TIMER}(x30)
        li x3 0x80
        csrs {MIE:#x} x3
        li x3 8
        li x5 0
        csrs {MSTATUS:#x} x3
    wait:
        beq x5 x0 wait
        li x6 0x77
    """
    handler = f"""
    trap:
        csrr x5 {MCAUSE:#x}
        lw x7 0(x30)
        sub x7 x7 x2
        sw x0 {TIMER}(x30)
        mret
    """
    cause, late, after = run(text + say("x5", "x7", "x6") + END + handler)["O"]
    assert cause == 0x80000007 and 0 <= late < 100 and after == 0x77


def test_no_software_interrupt_ever(run) -> None:
    """Bit 3 of mip stays low, and letting it in lets nothing in."""
    body = (
        f"""
        li x2 8
        csrs {MIE:#x} x2
        csrs {MSTATUS:#x} x2
        li x3 200
    count:
        addi x3 x3 -1
        bne x3 x0 count
        csrr x4 {MIP:#x}
        andi x4 x4 8
    """
        + say("x4")
        + END
    )
    assert run(trap(body, say("x30")))["O"] == [0]


@pytest.mark.parametrize("where", [0x7FFFFFF0, 0x80000000, 0x00100000])
def test_no_instructions_where_no_memory_is(run, where: int) -> None:
    """They read as 0, which is none: a trap with the place."""
    handler = f"csrr x3 {MCAUSE:#x}\ncsrr x4 {MEPC:#x}\n" + say("x3", "x4")
    assert run(trap(f"li x1 {where:#x}\njr x1\n", handler))["O"] == [2, where]


def test_the_watchdog_restarts_an_endless_loop(run) -> None:
    """The second time the program sees why it began, and kicks in time from then on."""
    text = (
        f"""
        lw x1 {STATUS}(x30)
        andi x1 x1 16
    """
        + say("x1")
        + f"""
        beq x1 x0 stuck
        li x2 {KICK:#x}
        li x3 150000
    kick:
        sw x2 {WATCHDOG}(x30)
        addi x3 x3 -1
        bne x3 x0 kick
    """
        + END
        + """
    stuck:
        j stuck
    """
    )
    said = run(text)
    assert said["O"] == [0, 16] and len(said["W"]) == 1


def test_console_echo(run) -> None:
    """Every received byte goes back, one more."""
    text = f"""
        li x5 3
    wait:
        lw x1 {STATUS}(x30)
        andi x1 x1 2
        beq x1 x0 wait
        lw x2 {CONSOLE}(x30)
        addi x2 x2 1
        sw x2 {CONSOLE}(x30)
        addi x5 x5 -1
        bne x5 x0 wait
        li x5 400
    drain:
        addi x5 x5 -1
        bne x5 x0 drain
    """
    said = run(text + END, keys="FE4241", keys_at=500)
    assert said["T"] == [0x42, 0x43, 0xFF]
