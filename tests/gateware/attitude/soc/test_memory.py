"""The soft core's processor, bus, memory and address map."""

import re
import subprocess
import sys

import pytest
from amaranth.hdl import Const
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.soc import cpu
from boresight.gateware.attitude.soc.attitude_soc import CONSOLE, AttitudeSoc
from boresight.gateware.attitude.soc.bus import BURST, ProcessorBus
from boresight.gateware.attitude.soc.cpu import RESET_VECTOR, Cpu, cpu_verilog
from boresight.gateware.attitude.soc.layout import (
    CONTROL,
    CONTROL_BASE,
    INTERRUPTS,
    KICK,
    SLOT_BASE,
    soc_header,
)
from boresight.gateware.attitude.soc.memory import PAGE_WORDS, Ram
from boresight.gateware.attitude.soc.system import Soc, soc_verilog
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.verilog import to_verilog
from boresight.model.errors import ToolMissing

# -- the soft core's memory on its two buses: bytes, bursts, and what is refused ------------------

WORDS = 3 * PAGE_WORDS


async def access(ctx, dut, bus, address: int, word: int | None = None, sel: int = 0xF) -> tuple:
    """One access: (word that was read, whether it was refused)."""
    ctx.set(bus.adr, address)
    ctx.set(bus.we, word is not None)
    ctx.set(bus.dat_w, word or 0)
    ctx.set(bus.sel, sel)
    ctx.set(bus.cyc, 1)
    ctx.set(bus.stb, 1)
    assert not ctx.get(bus.ack)
    await ctx.tick()
    assert ctx.get(bus.ack), "a cycle later"
    result = ctx.get(bus.dat_r), bool(ctx.get(dut.refused))
    await ctx.tick()
    assert not ctx.get(bus.ack), "one acknowledgement an access"
    ctx.set(bus.cyc, 0)
    ctx.set(bus.stb, 0)
    return result


def test_words_on_both_buses(ram, simulate) -> None:
    dut = Ram(words=WORDS)

    async def bench(ctx):
        for address in (0, 1, 2, 255, 256, WORDS - 1):
            assert (await access(ctx, dut, dut.dbus, address, address * 0x10101 + 7))[1] is False
        for address in (0, 1, 2, 255, 256, WORDS - 1):
            for bus in (dut.ibus, dut.dbus):
                assert await access(ctx, dut, bus, address) == (address * 0x10101 + 7, False)

    simulate(dut, bench)


@pytest.mark.parametrize("sel", range(16))
def test_bytes(ram, simulate, sel: int) -> None:
    dut = Ram(words=WORDS)

    async def bench(ctx):
        await access(ctx, dut, dut.dbus, 5, 0x11223344)
        await access(ctx, dut, dut.dbus, 5, 0xAABBCCDD, sel)
        new, old = (w.to_bytes(4, "little") for w in (0xAABBCCDD, 0x11223344))
        wanted = bytes(new[k] if sel >> k & 1 else old[k] for k in range(4))
        assert await access(ctx, dut, dut.dbus, 5) == (int.from_bytes(wanted, "little"), False)

    simulate(dut, bench)


@pytest.mark.parametrize("beyond", [0, 1, PAGE_WORDS, 1 << 28])
def test_beyond_the_memory(ram, simulate, beyond: int) -> None:
    """From the first word on that is not there: reads 0, is not written, is refused."""
    dut = Ram(words=WORDS)

    async def bench(ctx):
        for address in range(WORDS):
            ctx.set(ram.contents.data[address], address + 1)
        assert await access(ctx, dut, dut.dbus, WORDS - 1) == (WORDS, False)
        for bus in (dut.ibus, dut.dbus):
            assert await access(ctx, dut, bus, WORDS + beyond) == (0, True)
        assert (await access(ctx, dut, dut.dbus, WORDS + beyond, 99))[1]
        await ctx.tick()
        assert [ctx.get(ram.contents.data[k]) for k in range(WORDS)] == list(range(1, WORDS + 1))
        assert await access(ctx, dut, dut.ibus, WORDS - 1) == (WORDS, False)

    simulate(dut, bench)


def test_a_write_at_the_size_itself_wraps_nowhere(ram, simulate) -> None:
    """A memory of 2^n words has no address bit to spare: word 2^n must not become word 0."""
    dut = Ram(words=PAGE_WORDS)
    assert len(dut.fence) == 1, "no page, or the only one"

    async def bench(ctx):
        await access(ctx, dut, dut.dbus, 0, 1234)
        assert (await access(ctx, dut, dut.dbus, PAGE_WORDS, 99))[1]
        assert await access(ctx, dut, dut.dbus, 0) == (1234, False)
        ctx.set(dut.fence, 1)
        assert (await access(ctx, dut, dut.dbus, 0, 99))[1]
        assert await access(ctx, dut, dut.dbus, 0) == (1234, False)

    simulate(dut, bench)


@pytest.mark.parametrize("fence", range(4))
def test_pages_below_the_fence_are_not_written(ram, simulate, fence: int) -> None:
    dut = Ram(words=WORDS)
    assert len(dut.fence) == 2, "none to all three"

    async def bench(ctx):
        ctx.set(dut.fence, fence)
        for page in range(3):
            for address in (page * PAGE_WORDS, (page + 1) * PAGE_WORDS - 1):
                below = page < fence
                assert (await access(ctx, dut, dut.dbus, address, 77))[1] is below
                assert await access(ctx, dut, dut.dbus, address) == (0 if below else 77, False)

    simulate(dut, bench)


@pytest.mark.parametrize("name", ["ibus", "dbus"])
def test_a_burst_gives_a_word_in_each_cycle(ram, simulate, name: str) -> None:
    dut = Ram(words=WORDS)
    bus = getattr(dut, name)

    async def bench(ctx):
        for address in range(16):
            ctx.set(ram.contents.data[address], 100 + address)
        ctx.set(bus.adr, 4)
        ctx.set(bus.cyc, 1)
        ctx.set(bus.stb, 1)
        ctx.set(bus.cti, BURST)
        got = []
        await ctx.tick()
        for k in range(8):
            assert ctx.get(bus.ack) and not ctx.get(dut.refused)
            got.append(ctx.get(bus.dat_r))
            if k < 7:
                await ctx.tick()
                ctx.set(bus.adr, 4 + k + 1)
                ctx.set(bus.cti, 7 if k == 6 else BURST)
        await ctx.tick()
        assert not ctx.get(bus.ack), "the last word ends it"
        assert got == list(range(104, 112))

    simulate(dut, bench)


@pytest.mark.parametrize("missing", ["cyc", "stb"])
def test_without_a_strobe_nothing_happens(ram, simulate, missing: str) -> None:
    dut = Ram(words=WORDS)
    bus = dut.dbus

    async def bench(ctx):
        ctx.set(bus.sel, 0xF)
        ctx.set(bus.dat_w, 9)
        ctx.set(bus.we, 1)
        ctx.set(bus.stb if missing == "cyc" else bus.cyc, 1)
        for _ in range(4):
            await ctx.tick()
            assert not ctx.get(bus.ack) and not ctx.get(dut.refused)
        assert ctx.get(ram.contents.data[0]) == 0

    simulate(dut, bench)


# -- the processor's reset and connections --------------------------------------------------------


def test_reset_after_power_up_and_on_demand(processor, simulate) -> None:
    """Seven cycles: some of its registers need several to leave an unknown state."""
    dut = Cpu()

    async def bench(ctx):
        reset = processor["i_reset"]
        held = 0
        while ctx.get(reset):
            held += 1
            await ctx.tick()
        assert held == 7
        for _ in range(40):
            assert not ctx.get(reset)
            await ctx.tick()
        ctx.set(dut.restart, 1)
        assert ctx.get(reset)
        await ctx.tick().repeat(3)
        ctx.set(dut.restart, 0)
        assert not ctx.get(reset)

    simulate(dut, bench)


def test_every_port_of_the_processor_is_connected(processor, simulate) -> None:
    """Name and width as in the package's Verilog, but for what its debugger and burst logic say."""

    async def bench(ctx):
        ports = {
            name: (way, int(high or 0) + 1)
            for way, high, name in re.findall(
                r"(?m)^\s*(input|output)\s+(?:wire|reg)?\s*(?:\[(\d+):0\])?\s*(\w+)[,)\s]*$",
                re.search(r"(?s)module VexRiscv \((.*?)\);", cpu_verilog())[1],
            )
        }
        results = {
            name.split("_", 1)[1]: ({"i": "input", "o": "output"}[name[0]], len(value))
            for name, value in processor.items()
            if name != "i_clk"
        }
        unused = set(ports) - set(results) - {"clk"}
        assert unused <= {"iBusWishbone_BTE", "dBusWishbone_BTE"}
        assert results == {name: ports[name] for name in results}

    simulate(Cpu(), bench)


def test_what_never_happens_is_tied_low(processor, simulate) -> None:
    async def bench(ctx):
        constants = {n: v.value for n, v in processor.items() if isinstance(v, Const)}
        assert constants == {
            "i_externalResetVector": RESET_VECTOR,
            "i_softwareInterrupt": 0,
            "i_iBusWishbone_ERR": 0,
            "i_dBusWishbone_ERR": 0,
        }

    simulate(Cpu(), bench)


# -- the processor's bus: its members, its widths -------------------------------------------------


def test_members_as_the_processor_sees_them() -> None:
    members = ProcessorBus(addr_width=14).members
    assert {name: (member.flow, member.shape) for name, member in members.items()} == {
        "adr": (Out, 14),
        "dat_w": (Out, 32),
        "dat_r": (In, 32),
        "sel": (Out, 4),
        **{name: (Out, 1) for name in ("cyc", "stb", "we")},
        "cti": (Out, 3),
        "ack": (In, 1),
    }
    assert ProcessorBus().members["adr"].shape == 30
    assert BURST == 0b010  # Wishbone B4: incrementing burst


@pytest.mark.parametrize("width", [0, 31])
def test_address_bits(width: int) -> None:
    assert ProcessorBus(addr_width=1).members["adr"].shape == 1
    with pytest.raises(ValueError, match=f"^addr_width must be 1 to 30, not {width}$"):
        ProcessorBus(addr_width=width)


# -- the header agrees with the table, and C takes it ---------------------------------------------


def test_header_has_every_register_and_bit() -> None:
    defined = dict(re.findall(r"(?m)^#define SOC_(\w+) (\S+)", soc_header()))
    assert int(defined["CONTROL_BASE"][9:-1], 16) == CONTROL_BASE
    assert int(defined["SLOT_BASE"][9:-1], 16) == SLOT_BASE
    assert int(defined["WATCHDOG_KICK"][9:-1], 16) == KICK
    for address, register in enumerate(CONTROL):
        assert int(defined[f"{register.name.upper()}_ADDR"]) == address
        for k, bit in enumerate(register.bits):
            text = defined[f"{register.name.upper()}_{bit.upper()}"]
            assert int(text[9:-1], 16) == 1 << k
    for k, name in enumerate(INTERRUPTS):
        assert int(defined[f"INTERRUPT_{name.upper()}"][9:-1], 16) == 1 << k


def test_c_takes_it(tmp_path) -> None:
    (tmp_path / "soc_registers.h").write_text(soc_header())
    (tmp_path / "x.c").write_text(
        '#include <stdint.h>\n#include "soc_registers.h"\n'
        "int main(void) { return SOC_STATUS_DEVICE != 0; }\n"
    )
    subprocess.run(
        ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "x.c", "-o", "x"],
        cwd=tmp_path,
        check=True,
    )


def test_registers_fit_their_addresses() -> None:
    assert len(CONTROL) <= 8
    assert len({r.name for r in CONTROL}) == len(CONTROL)


# -- the parts' arguments, and that the system is one that the part can hold by itself ------------


def test_verilog_of_all_parts() -> None:
    files = soc_verilog(Soc(words=1024, divisor=8))
    assert list(files) == ["soc.v", "ram.v", "VexRiscv.v"]
    for name, module in (("soc.v", "soc"), ("ram.v", "boresight_ram"), ("VexRiscv.v", "VexRiscv")):
        assert f"module {module}" in files[name]
    assert '.IMAGE("firmware.hex")' in files["soc.v"]


@pytest.mark.parametrize("words", [0, 100, 255, 65536 + 256])
def test_memory_sizes(words: int) -> None:
    with pytest.raises(ValueError, match="^words must be a multiple of 256 up to 65536, not"):
        Ram(words=words)


def test_missing_package_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cpu, "_PACKAGE", "no_such_package")
    with pytest.raises(
        ToolMissing,
        match=r"^the soft core was not found: run 'pip install "
        r"pythondata-cpu-vexriscv' in this Python env\w+$",
    ):
        cpu_verilog()
    assert "no_such_package" not in sys.modules


# -- system and soft core together: which pins, and that one without Wishbone is refused ----------


@pytest.fixture(scope="module")
def core():
    return system_core(("complementary",))


def test_needs_the_wishbone(core) -> None:
    with pytest.raises(ValueError, match="^system must be made with wishbone=True, not without$"):
        AttitudeSoc(system=AttitudeSystem(core=core))


def test_pins(core) -> None:
    system = AttitudeSystem(core=core, wishbone=True)
    dut = AttitudeSoc(system=system, words=1024)
    assert dut.lines == (*system.lines, *CONSOLE)
    for line in dut.lines:
        assert line.name in dut.signature.members
    assert "wb" not in dut.signature.members
    text = to_verilog(dut, "attitude_soc", instances=True)
    head = text[text.index("module attitude_soc(") :]
    head = head[: head.index(";")]
    for line in dut.lines:
        assert line.name in head
    assert "DSP48A1" in text and "VexRiscv" in text and "boresight_ram" in text
