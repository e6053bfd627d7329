"""Who is connected to whom in the complete system: its parts are empty, their outputs the bench's.

Pins, readers, core, output and bridge have no inside here; registers, counters, arbiter and
Wishbone slave are the real ones.
"""

import random
from collections.abc import Callable, Iterator

import pytest
from amaranth.hdl import Cat, DriverConflict, Module, Value
from amaranth.lib.wiring import Out

from boresight.gateware.attitude.bus.arbiter import BusArbiter
from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system import attitude_system
from boresight.gateware.attitude.system.attitude_core import AttitudeCore
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.bridge import Bridge
from boresight.gateware.attitude.system.interface import FRAME_FLAGS
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.attitude.system.system_bus import RESULTS, SystemBus
from boresight.gateware.core import Core
from tests.support.bench import pulse

EMPTY = (Adis16385, Hmr3300, AttitudeCore, AttitudeOutput, Bridge)


@pytest.fixture(scope="module")
def core() -> Core:
    """Two filters: one bit says which."""
    return system_core(("complementary", "mekf"))


class Bench:
    """The system with empty parts, and a host that stands where the bridge's inside would be."""

    def __init__(self, core: Core, patch: pytest.MonkeyPatch, simulate: Callable) -> None:
        self.core, self.simulate = core, simulate
        self.inner: list = []  # made while elaborating
        self.time: Value  # the register
        for part in EMPTY:
            patch.setattr(part, "elaborate", lambda part, platform: Module())
        for part in (SystemBus, BusArbiter):
            patch.setattr(attitude_system, part.__name__, self._keep(part))
        lights = AttitudeSystem._lights

        def keep_time(system, m, time) -> None:
            self.time = time
            lights(system, m, time)

        patch.setattr(AttitudeSystem, "_lights", keep_time)

    def _keep(self, part: type) -> Callable:
        def make(**parameters):
            self.inner.append(part(**parameters))
            return self.inner[-1]

        return make

    def run(self, test: Callable, *background: Callable, **options) -> None:
        self.system = system = AttitudeSystem(core=self.core, **options)
        self.inertial, self.compass = system._inertial, system._compass
        self.attitude, self.output, self.bridge = system._attitude, system._output, system._bridge
        self.address = {r.name: r.address for r in system.map().registers}
        self.parts = (self.inertial, self.compass, self.attitude, self.output, self.bridge)
        self.simulate(system, test, *background)

    async def read(self, ctx, name: str) -> int:
        """The host reads a register."""
        bridge = self.bridge
        ctx.set(bridge.bus.addr, self.address[name])
        ctx.set(bridge.request, 1)
        await ctx.tick().until(bridge.grant)
        ctx.set(bridge.request, 0)
        return ctx.get(bridge.bus.r_data)

    async def write(self, ctx, name: str, word: int) -> None:
        """The host writes a register."""
        bridge = self.bridge
        ctx.set(bridge.bus.addr, self.address[name])
        ctx.set(bridge.bus.w_data, word)
        ctx.set(bridge.bus.w_stb, 1)
        ctx.set(bridge.request, 1)
        await ctx.tick().until(bridge.bus.w_ack)
        ctx.set(bridge.bus.w_stb, 0)
        ctx.set(bridge.request, 0)

    @property
    def settings(self) -> dict[str, Value]:
        """Register: what it sets."""
        return {
            "run": self.attitude.run,
            "filter": self.attitude.filter,
            "magnetic_source": self.attitude.source,
            "output_mode": self.output.on,
            "output_divider": self.output.divider,
            "inertial_msc_ctrl": self.inertial.msc_ctrl,
            "inertial_smpl_prd": self.inertial.smpl_prd,
            "inertial_sens_avg": self.inertial.sens_avg,
            "compass_mode": self.compass.mode,
            "results_hold": ~self.attitude.ports[1].take,
        }

    def wires(self) -> Iterator[tuple[Value, Value]]:
        """What is driven, and what drives it."""
        system, inertial, compass, attitude, output, bridge = self.system, *self.parts
        for name in ("cs_n", "sclk", "mosi", "reset_n"):
            yield getattr(system, f"adis_{name}"), getattr(inertial, name)
        for name in ("miso", "data_ready"):
            yield getattr(inertial, name), getattr(system, f"adis_{name}")
        yield from ((compass.rx, system.hmr_rx), (system.hmr_tx, compass.tx))
        yield from ((bridge.rx, system.host_rx), (system.host_tx, bridge.tx))
        yield inertial.index, attitude.index
        for name in ("word", "sample", "stamp"):
            yield getattr(attitude, name), getattr(inertial, name)
        for name in ("line", "is_counts"):
            yield getattr(attitude, name), getattr(compass, name)
        for k in range(3):
            yield attitude.values[k], compass.values[k]
            yield getattr(system, f"probe_value{k}"), compass.values[k]
        yield output.updated, attitude.updated
        for name in ("valid", "payload"):
            yield getattr(bridge.i, name), getattr(output.o, name)
        yield output.o.ready, bridge.i.ready
        for name in ("take", "index"):
            yield getattr(attitude.ports[0], name), getattr(output.port, name)
        yield output.port.value, attitude.ports[0].value
        yield system.probe_sample, inertial.sample
        yield system.probe_running, inertial.flags.running
        yield system.probe_updated, attitude.updated
        yield system.probe_program, attitude.conductor.choice
        yield system.probe_line, compass.line
        yield system.probe_counts, compass.is_counts
        yield system.probe_events, Cat(part.events for _, part in system._sources)


def bits(value: Value) -> Value:
    """Without its sign or structure."""
    return Value.cast(value).as_unsigned()


@pytest.fixture
def bench(core: Core, monkeypatch: pytest.MonkeyPatch, simulate: Callable) -> Bench:
    return Bench(core, monkeypatch, simulate)


@pytest.fixture
def rng() -> random.Random:
    return random.Random(1)


def test_what_comes_out_of_a_part_goes_in_elsewhere(bench: Bench, rng: random.Random) -> None:
    async def test(ctx):
        wires = [(bits(sink), bits(source)) for sink, source in bench.wires()]
        assert all(len(sink) == len(source) for sink, source in wires)
        for _ in range(40):
            for _, source in wires:
                ctx.set(source, rng.getrandbits(len(source)))
            for sink, source in wires:
                assert ctx.get(sink) == ctx.get(source), (sink, source)

    bench.run(test)


@pytest.mark.parametrize("wishbone", [False, True])
def test_no_input_is_left_open(wishbone: bool, bench: Bench) -> None:
    async def test(ctx):
        command = bench.compass.command
        registers = [id(command.valid), id(Value.cast(command.payload))]  # another test has them
        for part in (*bench.parts, *bench.inner):
            for path, member, value in part.signature.flatten(part):
                plain = bits(value)
                if member.flow is Out or id(Value.cast(value)) in registers:
                    continue
                with pytest.raises(DriverConflict):
                    ctx.set(plain, 0)
                    pytest.fail(f"{type(part).__name__}: {path} is open")
        assert len(bench.inner) == 1 + wishbone

    bench.run(test, wishbone=wishbone)


def test_time_goes_everywhere_and_wraps(bench: Bench) -> None:
    async def test(ctx):
        parts = (bench.inertial, bench.compass, bench.attitude, *bench.inner)
        assert [ctx.get(part.time) for part in parts] == [0] * 4
        await ctx.tick().repeat(3)
        assert [ctx.get(part.time) for part in parts] == [3] * 4
        ctx.set(bench.time, 0xFFFF_FFFE)
        assert await bench.read(ctx, "time") == 0xFFFF_FFFE
        assert [ctx.get(part.time) for part in parts] == [0xFFFF_FFFF] * 4
        await ctx.tick()
        assert [ctx.get(part.time) for part in parts] == [0] * 4

    bench.run(test)


def test_the_host_reads_the_readers(bench: Bench, rng: random.Random) -> None:
    async def test(ctx):
        wires = {
            "inertial_flags": bench.inertial.flags,
            "temperature": bench.inertial.temperature,
            "diag_stat": bench.inertial.diag_stat,
            "compass_flags": bench.compass.flags,
            **{f"compass_{axis}": bench.compass.values[k] for k, axis in enumerate("xyz")},
        }
        for _ in range(20):
            words = {name: rng.getrandbits(len(bits(value))) for name, value in wires.items()}
            for name, value in wires.items():
                ctx.set(bits(value), words[name])
            assert {name: await bench.read(ctx, name) for name in wires} == words

    bench.run(test)


def test_each_setting_goes_to_one_place(bench: Bench) -> None:
    async def test(ctx):
        assert ctx.get(bench.inertial.enable)
        assert not ctx.get(bench.settings["results_hold"])
        for name, value in bench.settings.items():
            others = {n: ctx.get(v) for n, v in bench.settings.items() if n != name}
            for word in {0x3A5C, 0x0402, 0x8001, 2, 1, 0}:
                if len(value) <= 2 and word > 2 or word >= 1 << len(value):
                    continue
                await bench.write(ctx, name, word)
                await ctx.tick()
                assert ctx.get(value) == word, name
                assert {n: ctx.get(v) for n, v in bench.settings.items() if n != name} == others

    bench.run(test)


def test_orders_are_pulses(bench: Bench) -> None:
    seen = []

    async def watch(ctx):
        pulses = Cat(bench.attitude.restart, bench.inertial.restart, bench.inner[0].clear)
        async for _, _, order in ctx.tick().sample(pulses):
            seen.append(order)

    async def test(ctx):
        for order in (1, 2, 4, 7, 0):
            await bench.write(ctx, "order", order)
            await ctx.tick()

    bench.run(test, watch)
    assert [order for order in seen if order] == [1, 2, 4, 7]


def test_a_letter_waits_for_the_compass(bench: Bench) -> None:
    seen = []

    async def watch(ctx):
        command = bench.compass.command
        async for _, _, valid, ready, letter in ctx.tick().sample(
            command.valid, command.ready, command.payload
        ):
            if valid and ready:
                seen.append(chr(letter))

    async def test(ctx):
        command = bench.compass.command
        for letter in "AB":
            assert not ctx.get(command.valid)
            await bench.write(ctx, "compass_command", ord(letter))
            await ctx.tick().repeat(5)
            assert ctx.get(command.valid) and ctx.get(command.payload) == ord(letter)
            if letter == "A":  # the next one replaces it
                await bench.write(ctx, "compass_command", ord("Z"))
                await ctx.tick().repeat(5)
            await pulse(ctx, command.ready)
        ctx.set(command.ready, 1)
        for letter in "CD":  # to a reader that does not let it wait
            await bench.write(ctx, "compass_command", ord(letter))
            await ctx.tick().repeat(5)

    bench.run(test, watch)
    assert "".join(seen) == "ZBCD"


def test_the_host_reads_results(bench: Bench) -> None:
    async def test(ctx):
        reader = bench.attitude.ports[1]
        for name, address in bench.address.items():
            if not RESULTS <= address < RESULTS + 64:
                continue
            word = 0xA5A5_0000 | address
            ctx.set(reader.value, word)
            assert await bench.read(ctx, name) == word, name
            assert ctx.get(reader.index) == address - RESULTS, name

    bench.run(test)


def test_the_core_is_on_the_bus(bench: Bench) -> None:
    """It acknowledges writes late."""
    late, seen = 5, []

    async def core(ctx):
        bus, waited = bench.attitude.bus, 0
        ctx.set(bus.r_data, 0x1234_5678)
        async for _, _, strobe, ack, *word in ctx.tick().sample(
            bus.w_stb, bus.w_ack, bus.addr, bus.w_data
        ):
            if strobe and ack:
                seen.append(tuple(word))
            waited = 0 if ack else waited + strobe
            ctx.set(bus.w_ack, waited == late)

    async def test(ctx):
        for name in ("complementary.kp_roll_per_s", "status"):
            await bench.write(ctx, name, 0xFEDC_0000 | bench.address[name])
        assert await bench.read(ctx, "status") == 0x1234_5678

    bench.run(test, core)
    parameter, status = (bench.address[n] for n in ("complementary.kp_roll_per_s", "status"))
    assert seen == [(a, 0xFEDC_0000 | a) for a in (parameter, status)]


@pytest.mark.parametrize("wishbone", [False, True])
def test_reads_and_writes_of_nothing_are_counted_once(wishbone: bool, bench: Bench) -> None:
    async def test(ctx):
        bus, count = bench.inner[0], "count_bad_address"
        bench.address["nothing"] = 0x7FF
        assert await bench.read(ctx, count) == 0
        for access in (bench.read(ctx, "nothing"), bench.write(ctx, "nothing", 0)):
            before = await bench.read(ctx, count)
            await access
            ctx.set(bench.bridge.bus.addr, 0x7FF)  # and stays there, without a request
            await ctx.tick().repeat(2 * bus.counters.interval)
            assert await bench.read(ctx, count) == before + 1

    bench.run(test, wishbone=wishbone)


def test_host_and_processor_share_the_registers(bench: Bench) -> None:
    """Both at a time, in any order; neither gets the other's word."""
    words: dict[str, list[int]] = {"host": [], "processor": []}

    async def transfer(ctx, name: str, word: int | None = None) -> int:
        wb = bench.system.wb
        values = (bench.address[name], word is not None, word or 0, 1, 1)
        for member, value in zip((wb.adr, wb.we, wb.dat_w, wb.cyc, wb.stb), values, strict=True):
            ctx.set(member, value)
        while not ctx.get(wb.ack):
            await ctx.tick()
        answer = ctx.get(wb.dat_r)
        ctx.set(wb.cyc, 0)
        await ctx.tick()
        return answer

    async def processor(ctx):
        for k in range(40):
            await transfer(ctx, "inertial_msc_ctrl", k)
            words["processor"].append(await transfer(ctx, "inertial_msc_ctrl"))

    async def host(ctx):
        for k in range(60):
            await bench.write(ctx, "inertial_smpl_prd", 1000 + k)
            await ctx.tick().repeat(1 + k % 3)
            words["host"].append(await bench.read(ctx, "inertial_smpl_prd"))
        while len(words["processor"]) < 40:
            await ctx.tick()
        assert ctx.get(bench.inertial.msc_ctrl) == 39

    bench.run(host, processor, wishbone=True)
    assert words == {"host": list(range(1000, 1060)), "processor": list(range(40))}


def test_a_processor_is_told_of_updates(bench: Bench) -> None:
    async def test(ctx):
        assert len(bench.system.interrupt) == 1
        for updated in (0, 1, 0):
            ctx.set(bench.attitude.updated, updated)
            assert ctx.get(bench.system.interrupt) == updated

    bench.run(test, wishbone=True)


def test_every_event_has_its_counter(bench: Bench) -> None:
    async def test(ctx):
        (bus,) = bench.inner
        inputs = [bit for _, part in bench.system._sources for bit in part.events]
        assert len(inputs) == len(bench.system.events)
        for bit, name in zip(inputs, bench.system.events, strict=True):
            before = await bench.read(ctx, f"count_{name}")
            await pulse(ctx, bit)
            await ctx.tick().repeat(bus.counters.interval + 4)
            assert (before, await bench.read(ctx, f"count_{name}")) == (0, 1), name
        await bench.write(ctx, "order", 4)
        await ctx.tick().repeat(bus.counters.interval + 4)
        assert not any([await bench.read(ctx, f"count_{name}") for name in bench.system.events])

    bench.run(test)


def test_flags_of_a_frame(bench: Bench) -> None:
    async def test(ctx):
        flags = {
            "inertial_fault": ~bench.inertial.flags.running,
            "inertial_alarm": bench.inertial.flags.alarm,
            "over_range": bench.inertial.flags.over_range,
            "overrun": bench.inertial.flags.overrun,
            "compass_stale": bench.compass.flags.stale,
            "compass_fault": bench.compass.flags.paused,
        }
        for chosen in [None, *flags]:
            for part in (bench.inertial, bench.compass):
                ctx.set(bits(part.flags), 0)
            ctx.set(bench.inertial.flags.running, chosen != "inertial_fault")
            if chosen in flags and chosen != "inertial_fault":
                ctx.set(flags[chosen], 1)
            raised = ctx.get(bench.output.flags)
            names = [flag.name for flag in FRAME_FLAGS if flag.of(raised << 24)]
            assert names == [chosen] * (chosen is not None)

    bench.run(test)


def test_the_light_of_faults(bench: Bench) -> None:
    async def test(ctx):
        inertial, compass = bench.inertial.flags, bench.compass.flags
        lit = {"running": False, "link_error": True, "alarm": True, "stale": True}
        flags = {**inertial.shape().members, **compass.shape().members}
        for chosen in [None, *flags]:
            ctx.set(bits(inertial), 0)
            ctx.set(bits(compass), 0)
            ctx.set(inertial.running, 1)
            if chosen is not None:
                part = inertial if chosen in inertial.shape().members else compass
                ctx.set(part[chosen], 1)
            await ctx.tick()
            assert ctx.get(bench.system.led_fault) == lit.get(chosen, False), chosen
        ctx.set(bits(compass), 0)
        ctx.set(inertial.running, 0)
        await ctx.tick()
        assert ctx.get(bench.system.led_fault)

    bench.run(test)


@pytest.mark.parametrize("clock_hz, bit", [(100e6, 25), (40e6, 24), (400e6, 25)])
def test_the_light_of_updates(clock_hz: float, bit: int, bench: Bench) -> None:
    """It changes where the time's bit does, if an update has come since the last time."""

    async def test(ctx):
        async def half_period(updates: int) -> int:
            """How often the light has changed."""
            changed, before = 0, ctx.get(bench.system.led_running)
            beginning = ctx.get(bench.time) >> bit << bit
            for time in (beginning + (1 << bit - 1), beginning + (1 << bit) - 8):
                ctx.set(bench.time, time)
                for _ in range(12):
                    update = updates > 0
                    updates -= update
                    ctx.set(bench.attitude.updated, update)
                    _, _, light = await ctx.tick().sample(bench.system.led_running)
                    changed += light != before
                    before = light
            return changed

        assert [await half_period(n) for n in (0, 1, 3, 0, 0, 1, 1, 0)] == [0, 1, 1, 0, 0, 1, 1, 0]

    bench.run(test, clock_hz=clock_hz)
