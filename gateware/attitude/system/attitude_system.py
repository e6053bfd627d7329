"""The complete attitude system: sensor pins in, attitude out."""

from __future__ import annotations

import hashlib
from typing import Any

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.fifo import SyncFIFO
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.sensors.adis16385 import SETTINGS, TEST_BITS, Adis16385, Timing
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system import interface
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput, Bridge
from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.csr import packed
from boresight.gateware.attitude.system.system_bus import SystemBus
from boresight.gateware.boards.board import Line
from boresight.gateware.bus.core_registers import layout_of
from boresight.gateware.core import Core
from boresight.gateware.description import Description, describe
from boresight.model.errors import InputError


class AttitudeSystem(wiring.Component):
    r"""Readers, core, registers and output: the design of a board's bitstream.

    ::

        ADIS16385 -- Adis16385 --\                   /-- results -- SystemBus -- Bridge -- host
                                  Conductor ---------<
        HMR3300 ---- Hmr3300 ----/                    \-- AttitudeOutput --------/

    There is one clock domain; every asynchronous input passes two flip-flops. Accesses of the host
    cannot delay the filter. With a core whose memories have a register behind them (depth 9 and
    more) a read of a register takes a cycle more.

    **Latency** `latency_cycles`: data-ready edge at the pin to new results.

    ``core`` is one of `gateware.attitude.system.programs.system_core`; ``inertial`` and ``compass``
    are other readers than the default ones. The pins are `_LINES`; ``probe_*`` are for simulation,
    unconnected on a board.
    """

    def __init__(
        self,
        *,
        core: Core,
        clock_hz: float = 100e6,
        host_baud: float = 921_600,
        inertial: Adis16385 | None = None,
        compass: Hmr3300 | None = None,
    ) -> None:
        self.core = core
        self.clock_hz = clock_hz
        self.host_baud = host_baud
        self._inertial = inertial or Adis16385(clock_hz=clock_hz)
        self._compass = compass or Hmr3300(clock_hz=clock_hz)
        self._attitude = Conductor(core=core)
        self.plan, reads = self._attitude.plan, self._attitude.read_cycles
        self._bridge = Bridge(clock_hz=clock_hz, baud=host_baud, read_cycles=reads)
        self._output = AttitudeOutput(read_cycles=reads)
        self.title = "attitude system"
        self.lines = _LINES
        #: Counted events, by their bits: source and name.
        self._sources = (
            ("inertial", self._inertial),
            ("compass", self._compass),
            ("core", self._attitude),
            ("host", self._bridge),
            ("output", self._output),
        )
        self._orders = (
            (*interface.ORDERS, interface.TAKE_FEED)
            if self.plan.feed.registers
            else interface.ORDERS
        )
        self.events = tuple(
            f"{source}_{name}" for source, part in self._sources for name in part.EVENTS
        )
        self.registers = interface.system_registers(
            filters=self.plan.names[: self.plan.filters],
            clock_hz=clock_hz,
            build=self.build,
            feed=bool(self.plan.feed.registers),
        )
        super().__init__(
            {
                **{line.name: In(1, init=1) if line.input else Out(1) for line in _LINES},
                **{f"probe_{name}": Out(1) for name in _PROBES},
                **{f"probe_value{k}": Out(16) for k in range(3)},
                "probe_events": Out(len(self.events)),
            }
        )

    @property
    def build(self) -> int:
        """Digest of programs and configuration, 64 bits: registers system_build_low and _high."""
        adis, compass = self._inertial, self._compass
        speeds = (adis.burst_cycles, adis.start_cycles, compass.divisor)
        system = (float(self.clock_hz), self._bridge.divisor)
        configuration = repr((self.core.digest, self.core.machine, *system, *speeds))
        return int(hashlib.sha256(configuration.encode()).hexdigest()[:16], 16)

    def map(self) -> Description:
        return interface.system_map(
            self.core, registers=self.registers, events=self.events, feed=self.plan.feed.registers
        )

    def latency_cycles(self, number: int) -> int:
        """Data-ready at the pin to new results of a filter, without writes of parameters."""
        return self.transfer_cycles + self._attitude.latency(number)

    @property
    def transfer_cycles(self) -> int:
        """Data-ready at the pin to a whole, checked sample: nine frames on the SPI."""
        return self._inertial.burst_cycles

    readme = "board_system"

    def facts(self) -> dict[str, Any]:
        """Values of the system for a project's README, with each filter's latency."""
        cycles = [self.latency_cycles(k) for k in range(self.plan.filters)]
        times = [f"{1e6 * n / self.clock_hz:.2f}" for n in cycles]
        rows = zip(range(len(cycles)), self.plan.names, cycles, times, strict=False)
        return {
            "core": describe(self.core),
            "build": self.build,
            "baud": self.host_baud,
            "rate": 1.0 / Timing().period_s,
            "filters": self.plan.filters,
            "latencies": [("number", "filter", "cycles", "microseconds"), *rows],
        }

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.inertial, m.submodules.compass = self._inertial, self._compass
        m.submodules.attitude = attitude = self._attitude
        m.submodules.output, m.submodules.bridge = self._output, self._bridge
        m.submodules.bus = bus = SystemBus(
            registers=self.registers,
            events=len(self.events),
            feed=len(self.plan.feed.registers),
            read_cycles=self._attitude.read_cycles,
        )
        time = Signal(32)
        # Orders of a write of register ``order`` in the cycle before, by name.
        orders: Any = Signal(layout_of(self._orders))
        m.d.sync += [time.eq(time + 1), orders.eq(bus.order)]
        self._sensors(m, bus, orders, time)
        self._filter(m, bus, orders)
        self._results(m, bus)
        bridge = self._bridge
        wiring.connect(m, bridge.bus, bus.bus)
        m.d.comb += [
            bridge.rx.eq(self.host_rx),
            self.host_tx.eq(bridge.tx),
            bus.read.eq(bridge.reads),
        ]
        inertial, compass = self._inertial, self._compass
        m.d.sync += self.led_running.eq(attitude.number[_BLINK_BIT])
        m.d.sync += self.led_fault.eq(
            ~inertial.flags.running
            | inertial.flags.link_error
            | inertial.flags.alarm
            | compass.flags.stale
            | inertial.diag_stat[min(TEST_BITS)]
        )
        m.d.comb += [
            bus.time.eq(time),
            bus.events.eq(Cat(part.events for _, part in self._sources)),
            bus.clear.eq(orders.clear_counters),
            self.probe_sample.eq(inertial.sample),
            self.probe_running.eq(inertial.flags.running),
            self.probe_updated.eq(attitude.updated),
            self.probe_line.eq(compass.line),
            self.probe_counts.eq(compass.is_counts),
            self.probe_events.eq(bus.events),
            *(getattr(self, f"probe_value{k}").eq(compass.values[k]) for k in range(3)),
        ]
        return m

    def _sensors(self, m: Module, bus: SystemBus, orders: Any, time: Signal) -> None:
        """Pins, readers, and their registers."""
        inertial, compass, csr = self._inertial, self._compass, bus
        for name in ("cs_n", "sclk", "mosi", "reset_n"):
            m.d.comb += getattr(self, f"adis_{name}").eq(getattr(inertial, name))
        m.d.comb += [
            inertial.miso.eq(self.adis_miso),
            inertial.data_ready.eq(self.adis_data_ready),
            compass.rx.eq(self.hmr_rx),
            self.hmr_tx.eq(compass.tx),
            inertial.time.eq(time),
            inertial.restart.eq(orders.restart_inertial),
            *(getattr(inertial, name).eq(getattr(csr, f"inertial_{name}")) for name in SETTINGS),
            csr.inertial_flags.eq(inertial.flags),
            csr.temperature.eq(inertial.temperature),
            csr.diag_stat.eq(inertial.diag_stat),
            compass.time.eq(time),
            compass.mode.eq(csr.compass_mode),
            compass.slower.eq(csr.compass_baud),
            csr.compass_flags.eq(compass.flags),
            *(getattr(csr, f"compass_{a}").eq(compass.values[k]) for k, a in enumerate("xyz")),
        ]
        # A command waits until its reader can send it. A new inertial one replaces the one waiting.
        with m.If(inertial.command.ready):
            m.d.sync += inertial.command.valid.eq(0)
        with m.If(csr.inertial_command_stb):
            m.d.sync += [
                inertial.command.valid.eq(1),
                inertial.command.payload.eq(csr.inertial_command),
            ]
        m.submodules.compass_commands = queue = SyncFIFO(width=9, depth=16)
        m.d.comb += [queue.w_en.eq(csr.compass_command_stb), queue.w_data.eq(csr.compass_command)]
        wiring.connect(m, queue.r_stream, compass.command)

    def _filter(self, m: Module, bus: SystemBus, orders: Any) -> None:
        inertial, compass, attitude = self._inertial, self._compass, self._attitude
        m.d.comb += [
            inertial.index.eq(attitude.index),
            *(getattr(attitude, n).eq(getattr(inertial, n)) for n in ("word", "sample", "stamp")),
            *(getattr(attitude, n).eq(getattr(compass, n)) for n in ("line", "is_counts")),
            *(attitude.values[k].eq(compass.values[k]) for k in range(3)),
            *(getattr(attitude, n).eq(getattr(bus, n)) for n in ("run", "filter")),
            attitude.source.eq(bus.magnetic_source),
            attitude.restart.eq(orders.restart_filter),
            attitude.load_states.eq(orders.initial_states),
        ]
        if self.plan.feed.registers:
            m.d.comb += [
                *(getattr(attitude, n).eq(getattr(bus, n)) for n in _FEED),
                attitude.feed_take.eq(orders.take_feed),
                bus.feed_busy.eq(attitude.feed_busy),
            ]

    def _results(self, m: Module, bus: SystemBus) -> None:
        attitude, output = self._attitude, self._output
        inertial, compass = self._inertial.flags, self._compass.flags
        m.d.comb += [
            output.updated.eq(attitude.updated),
            output.last_output.eq(attitude.last_output),
            output.on.eq(bus.output_mode.any()),
            output.record.eq(bus.output_mode[1]),
            output.divider.eq(bus.output_divider),
            output.flags.eq(
                packed(
                    interface.FRAME_FLAGS,
                    {
                        "inertial_fault": ~inertial.running,
                        "inertial_alarm": inertial.alarm,
                        "over_range": inertial.over_range,
                        "overrun": inertial.overrun,
                        "compass_stale": compass.stale,
                        "compass_fault": compass.paused,
                        "initial_states": attitude.from_initial,
                        "beyond": attitude.beyond,
                    },
                    first=interface.FRAME_FLAGS[0].bit,
                )
            ),
            attitude.ports[1].take.eq(~bus.results_hold),
            attitude.ports[1].index.eq(bus.results.index),
            bus.results.value.eq(attitude.ports[1].value),
        ]
        wiring.connect(m, output.o, self._bridge.i)
        wiring.connect(m, bus.core, attitude.bus)
        wiring.connect(m, output.port, attitude.ports[0])


#: Bit of an update's number that the LED shows: it changes with every 256th one.
_BLINK_BIT = 8
_PROBES = ("sample", "running", "updated", "line", "counts")
#: Ports for a write of an input register.
_FEED = ("feed_en", "feed_index", "feed_data")

_PULLED: Any = {"input": True, "pull_up": True}
_LINES = (
    Line("host_rx", "host_rx", "from the host: TXD of a 3.3 V serial adapter", **_PULLED),
    Line("host_tx", "host_tx", "to the host: RXD of the adapter"),
    Line("adis_cs_n", "adis_cs_n", "ADIS16385 CS"),
    Line("adis_sclk", "adis_sclk", "ADIS16385 SCLK"),
    Line("adis_mosi", "adis_mosi", "ADIS16385 DIN"),
    Line("adis_miso", "adis_miso", "ADIS16385 DOUT", **_PULLED),
    Line("adis_data_ready", "adis_data_ready", "ADIS16385 DIO1, data-ready", input=True),
    Line("adis_reset_n", "adis_reset_n", "ADIS16385 RST"),
    Line("hmr_rx", "hmr_rx", "from the compass's TX, which is 5 V: by a divider", **_PULLED),
    Line("hmr_tx", "hmr_tx", "to the compass's RX"),
    Line("led_running", "led0", "LED: blinks while updates come"),
    Line("led_fault", "led1", "LED: a sensor is not all right"),
)


def system_design(core: Core, clock_hz: int) -> AttitudeSystem:
    """Return the system of a board's project.

    `InputError`: a clock unfit for the serial lines.
    """
    try:
        return AttitudeSystem(core=core, clock_hz=clock_hz)
    except InputError:
        raise
    except ValueError as error:
        raise InputError.at(
            "clock",
            wanted="a clock from which both serial rates can be divided",
            found=f"{clock_hz / 1e6:g} MHz",
            fix="choose 23 MHz or more",
        ) from error
