"""Reader of the ADIS16385 inertial sensor: from reset to checked samples, and back after faults.

Addresses, identity and word formats are the maker's (register map of the iSensor evaluation
software); the meaning of the bits of DIAG_STAT, MSC_CTRL, SMPL_PRD and SENS_AVG is a sibling
part's (ADIS16334, ADIS1636x), and so is the pipeline: a frame's answer is what the frame before
it asked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.sensors.spi import SpiController, cycles_for

#: Register addresses.
REGISTERS: Final = {
    **{f"{axis}GYRO_OUT": 0x04 + 2 * k for k, axis in enumerate("XYZ")},
    **{f"{axis}ACCL_OUT": 0x0A + 2 * k for k, axis in enumerate("XYZ")},
    "TEMP_OUT": 0x10,
    "MSC_CTRL": 0x34,
    "SMPL_PRD": 0x36,
    "SENS_AVG": 0x38,
    "DIAG_STAT": 0x3C,
    "PROD_ID": 0x56,
}
#: Words of a sample, by their index: gyro, accelerometer, temperature, state.
WORDS: Final = (*list(REGISTERS)[:7], "DIAG_STAT")
#: Registers with known contents, in the order of their checks.
CHECKED: Final = ("PROD_ID", "MSC_CTRL", "SMPL_PRD", "SENS_AVG")
#: Contents of PROD_ID.
IDENTITY: Final = 0x4001
#: Ranges of the gyro by bits 10:8 of SENS_AVG (sibling part): how often +-300 deg/s is halved.
#: All other codes count as +-300 deg/s.
RANGE_SHIFTS: Final = {2: 1, 1: 2}
#: Fraction bits of a sample's words, so that every range has the same unit.
FRACTION: Final = max(RANGE_SHIFTS.values())
#: Bit of DIAG_STAT: a frame had not 16 clocks (sibling part).
COMM_FAILURE: Final = 1 << 3


def read(register: str) -> int:
    """Command that requests a register."""
    return REGISTERS[register] << 8


def write(register: str, byte: int, value: int) -> int:
    """Command that writes a byte (0 low, 1 high) of a register."""
    return 0x8000 | (REGISTERS[register] + byte) << 8 | value


@dataclass(frozen=True)
class Step:
    """A frame: its command, and the use of its reply."""

    register: str
    byte: int | None = None  #: that is written (0 low, 1 high); None: a read
    store: int | None = None  #: index of the sample's word in the reply
    #: Place in `CHECKED` of the register that the answer is; always the step's number modulo 4,
    #: and the step is a read.
    check: int | None = None


def _steps() -> dict[int, Step]:
    # Nothing is written to an unidentified device. What PROD_ID would get is the host's.
    steps = {
        HOST: Step("PROD_ID", 0),
        2: Step("DIAG_STAT"),
        3: Step("PROD_ID", store=WORDS.index("DIAG_STAT")),
        4: Step("PROD_ID", check=0),
        11: Step("PROD_ID"),
    }
    for k, name in enumerate(CHECKED[1:]):
        steps[5 + 2 * k], steps[6 + 2 * k] = Step(name, 0), Step(name, 1)
    for k, name in enumerate((*CHECKED[1:], "TEMP_OUT")):
        steps[12 + k] = Step(name, check=k)
    for k, name in enumerate((*WORDS[:6], "DIAG_STAT")):
        steps[16 + k] = Step(name, store=(k - 1) if k else WORDS.index("TEMP_OUT"))
    for k, name in enumerate(CHECKED):
        steps[24 + k] = Step(name, store=WORDS.index("DIAG_STAT"))
        steps[28 + k] = Step("TEMP_OUT", check=k)
    return steps


#: Step of a command of the host.
HOST: Final = 1
#: All frames by the number of their step: 2..15 at the start, 16..22, 24 + k, 28 + k for each
#: sample, with the place k of the register that is checked with this sample.
STEPS: Final = _steps()
#: First step, step that begins a self-test by bit 10 of MSC_CTRL (sibling part), first step of a
#: sample, last step before the check, a request of the temperature.
FIRST, TEST, FIRST_RUN, LAST, TEMPERATURE = 2, 6, 16, 22, 28
TEST_BYTE: Final = 1 << 10 - 8
#: Frames of the start, and of a sample.
CONFIG_FRAMES, RUN_FRAMES = 14, 9
#: Bits of DIAG_STAT (sibling part) that a self-test sets, and what has failed.
TEST_BITS: Final = {
    5: "self_test",
    **{10 + k: f"{axis}_gyro" for k, axis in enumerate("zyx")},
    **{13 + k: f"{axis}_acceleration" for k, axis in enumerate("xyz")},
}


@dataclass(frozen=True)
class Timing:
    """Times of the device, Hz and s."""

    #: Highest SPI clock and least pause between frames: those of the maker's own tool.
    sclk_hz: float = 1e6
    stall_s: float = 16e-6
    #: Least wait from the end of the reset pulse to the first frame; least length of that pulse
    #: (both unverified).
    startup_s: float = 0.3
    reset_s: float = 1e-3
    #: Wait for the self-test (unverified; sibling parts take 12 to 45 ms); 0: none is made.
    self_test_s: float = 0.05
    #: Nominal time between samples without decimation.
    period_s: float = 1 / 1024


#: Settings while the reader's members of the same names are not driven: data-ready on DIO1, active
#: high; 1024 samples/s; +-300 deg/s and a filter of 2**2 taps per stage.
SETTINGS: Final = {"msc_ctrl": 0x0006, "smpl_prd": 0x0001, "sens_avg": 0x0402}
#: Full scale of gyro and accelerometer, counts: a magnitude from there on is over-range.
FULL_SCALE: Final = (24_000, 20_000)
#: Bits of DIAG_STAT that raise the alarm.
ALARM_MASK: Final = 0xFF7F


#: Flag: meaning. In the order of their bits.
FLAG_MEANINGS: Final = {
    "running": "identity and settings are checked, samples are being read",
    "identity_error": "PROD_ID was wrong when last read",
    "config_error": "a setting was not what had been written when last read back",
    "no_data_ready": "the data-ready edge is overdue",
    "link_error": "the last sample was dropped: DIAG_STAT says so, or it followed a wrong one",
    "alarm": "DIAG_STAT of the last good sample has an alarm",
    "over_range": "a gyro or accelerometer of the last good sample is at full scale",
    "overrun": "a data-ready edge was skipped just before the last good sample",
}
#: Events, in the order of their bits, each one cycle long: a good sample, what the flags say of
#: samples and starts, and a reset pulse, after too many bad samples in a row, a start given up, or
#: an order.
EVENTS: Final = (
    *("sample", "identity_error", "config_error", "no_data_ready", "link_error"),
    *("alarm", "over_range", "overrun", "restart"),
)


#: Cycles from an edge at a pin until it is seen.
_SYNCHRONISER = 2
#: Cycles from a frame's reply to the sample.
_JUDGE = 2
#: Periods after which a data-ready edge counts as missing.
_TIMEOUT_PERIODS = 4.0
#: Largest exponent of the decimation in SMPL_PRD.
_DECIMATION_MAX = 12


class Adis16385(wiring.Component):
    """Reads a complete sample at each data-ready edge, and outputs it only if its checks pass.

    Start: reset pulse, wait, identity, settings (low byte, then high byte of each), all of them
    read back. The first start, and each one by ``restart``, has a self-test between identity and
    settings; the sensor is used even if it fails. Then 9 frames per sample: each requests a
    register and returns the one requested by the frame before. The first one returns the
    temperature of the sample before; the last one returns a register with known contents: identity
    and the three settings in turn (`CHECKED`). So stuck lines, an absent device, a slip of the
    pipeline, and a device that was reset and lost its settings all show as a wrong word there, and
    the sample is dropped. The same register is then checked until it is right again, and the first
    sample that passes is dropped as well, since the fault may have ended within it. A fault that
    begins and ends between two checks, shorter than the time between samples, is not detected.

    After ``bad_limit`` consecutive samples that are dropped or missing, or a wrong word during the
    start, the reader starts again from the reset pulse, until a start succeeds.

    A frame of ``command`` follows the next sample, and a request of the temperature follows it. So
    the host writes any byte of any register: offsets, GLOB_CMD, or MSC_CTRL to start a self-test,
    during which the check of MSC_CTRL fails and samples are dropped. A new start loses what was
    written, if it was not saved in the device's flash.

    DIAG_STAT: bits of `ALARM_MASK` raise the alarm, and the sample is used. The one for a frame
    with a wrong number of clocks (a sibling part's bit), after which the registers read are
    unknown, drops it.

    Waits are counted in ticks of ``tick_cycles`` from ``time``, in the time-out of ``2**D`` ticks
    with the decimation exponent D of SMPL_PRD (bits 11:8, up to 12; inferred from a sibling part).

    **Latency** ``sample`` comes `burst_cycles` after a data-ready edge.
    """

    EVENTS: Final = EVENTS

    def __init__(
        self, *, clock_hz: float, timing: Timing | None = None, bad_limit: int = 4
    ) -> None:
        timing = timing or Timing()
        self.bad_limit = bad_limit
        self.spi = SpiController(
            half_cycles=max(3, cycles_for(clock_hz=clock_hz, seconds=0.5 / timing.sclk_hz)),
            stall_cycles=cycles_for(clock_hz=clock_hz, seconds=timing.stall_s),
        )
        timeout = cycles_for(clock_hz=clock_hz, seconds=_TIMEOUT_PERIODS * timing.period_s)
        self.tick_bit = max(0, (timeout // 4).bit_length() - 1)
        self.timeout_ticks = self._ticks(timeout)
        self.reset_ticks = self._ticks(cycles_for(clock_hz=clock_hz, seconds=timing.reset_s))
        self.startup_ticks = self._ticks(cycles_for(clock_hz=clock_hz, seconds=timing.startup_s))
        self.test_ticks = math.ceil(timing.self_test_s * clock_hz / self.tick_cycles)
        period = cycles_for(clock_hz=clock_hz, seconds=timing.period_s)
        if period <= self.burst_cycles + self.spi.stall_cycles:
            burst_s = self.burst_cycles / clock_hz
            raise ValueError(
                f"period_s must be longer than a burst ({burst_s:.4g} s and a stall), "
                f"not {timing.period_s!r}"
            )
        super().__init__(
            {
                "cs_n": Out(1, init=1),
                "sclk": Out(1, init=1),
                "mosi": Out(1),
                "reset_n": Out(1),
                "miso": In(1),  # asynchronous to the clock, like ``data_ready``
                "data_ready": In(1),
                "time": In(32),  # counts clock cycles
                # Start over, for example because of new settings, taken during the reset pulse.
                "restart": In(1),
                **{name: In(16, init=word) for name, word in SETTINGS.items()},
                "command": In(stream.Signature(16)),  # ``0x8000 | address << 8 | byte``
                # A checked sample: its words, stamp and number hold for the stall between frames.
                "sample": Out(1),
                # Its words as in `WORDS`, combinational, with `FRACTION` fraction bits. A gyro word
                # is in counts of the +-300 deg/s range (0.0125 deg/s) in every range of SENS_AVG.
                "index": In(range(len(WORDS))),
                "word": Out(16 + FRACTION),
                # As last read, also of dropped samples. Bits that tell of a failed self-test
                # (`TEST_BITS`) are those read after the last one.
                "temperature": Out(16),
                "diag_stat": Out(16),
                "stamp": Out(32),  # ``time`` when its edge was seen, `_SYNCHRONISER` after it
                "number": Out(16),  # of its edge since the first start, modulo 2**16
                "flags": Out(data.StructLayout(dict.fromkeys(FLAG_MEANINGS, 1))),
                "events": Out(len(EVENTS)),
            }
        )

    def _ticks(self, cycles: int) -> int:
        return -(-cycles // self.tick_cycles)

    @property
    def tick_cycles(self) -> int:
        """Clock cycles of a tick. A wait of n ticks lasts from n to n + 1 of them, and a cycle."""
        return 1 << self.tick_bit

    @property
    def burst_cycles(self) -> int:
        """Clock cycles from a data-ready edge at the pin to ``sample``."""
        frames = (RUN_FRAMES - 1) * self.spi.frame_cycles + self.spi.answer_latency
        return _SYNCHRONISER + 1 + frames + _JUDGE

    @property
    def start_cycles(self) -> int:
        """Maximum clock cycles from a restart without a self-test to ``flags.running``."""
        ticks = self.reset_ticks + self.startup_ticks + 2
        return ticks * self.tick_cycles + (CONFIG_FRAMES + 1) * self.spi.frame_cycles + 8

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        r = _Registers(self)
        m.submodules.spi = spi = self.spi
        m.d.comb += [
            self.cs_n.eq(spi.cs_n),
            self.sclk.eq(spi.sclk),
            self.mosi.eq(spi.mosi),
            spi.miso.eq(self.miso),
        ]
        ready = Signal()
        ready_before = Signal()
        m.submodules.synchroniser = FFSynchronizer(self.data_ready, ready)
        m.d.sync += ready_before.eq(ready)
        m.d.comb += r.edge.eq(ready & ~ready_before)
        m.d.comb += r.known.eq(Array([self.command.payload, *r.used.values()])[r.which])
        self._frames(m, r)
        # One cycle after the answer: judged, stored, on to the next step. What the reply is for
        # and what it should be is known long before it comes.
        expected = Signal.like(r.known)
        m.d.sync += [
            expected.eq(Mux(r.which == 0, IDENTITY, r.known)),
            r.answered.eq(spi.o_valid & r.spi_turn & ~r.start_over),
            r.storing.eq(spi.o_valid & r.spi_turn & r.stores),
            r.judging.eq(spi.o_valid & r.spi_turn & r.checks & ~r.start_over),
            r.equal.eq(spi.o_data == expected),
        ]
        self._buffer(m, r)
        self._wait(m, r)
        with m.FSM() as fsm:
            with m.State("RESET"):
                self._reset(m, r)
            with m.State("STARTUP"):
                m.d.comb += r.ticks.eq(Mux(r.testing, self.test_ticks, self.startup_ticks))
                with m.If(r.start_over):
                    m.next = "RESET"
                with m.Elif(r.expired & ~spi.busy):
                    m.next = "FRAMES"
            with m.State("FRAMES"):
                self._next_frame(m, r)
            with m.State("EDGE"):
                self._await_edge(m, r)
        self._judge(m, r)
        m.d.sync += [self.events.eq(Cat(r.event.values())), self.sample.eq(r.event["sample"])]
        m.d.comb += [
            self.flags.running.eq(r.running),
            r.spi_turn.eq(fsm.ongoing("FRAMES")),
            spi.i.valid.eq(r.spi_turn | r.extra.any()),
        ]
        m.d.sync += self.reset_n.eq(~fsm.ongoing("RESET"))
        return m

    def _buffer(self, m: Module, r: _Registers) -> None:
        """Words of the sample, and their own checks."""
        spi = self.spi
        m.submodules.buffer = buffer = memory.Memory(
            shape=16 + FRACTION, depth=len(WORDS), init=[], attrs={"ram_style": "distributed"}
        )
        writer = buffer.write_port()
        reader = buffer.read_port(domain="comb")
        is_temperature = r.place == WORDS.index("TEMP_OUT")
        word = Signal(signed(16))
        m.d.comb += [
            word.eq(
                Cat(
                    spi.o_data[:12],
                    Mux(is_temperature, spi.o_data[11].replicate(4), spi.o_data[12:]),
                )
            ),
            writer.addr.eq(r.place),
            writer.en.eq(r.storing),
            writer.data.eq(word << FRACTION),
            reader.addr.eq(self.index),
            self.word.eq(reader.data),
        ]
        with m.If(r.place < 3):
            for bits, shift in RANGE_SHIFTS.items():
                with m.If(r.used["sens_avg"][8:11] == bits):
                    m.d.comb += writer.data.eq(word << FRACTION - shift)
        with m.If(writer.en & is_temperature):
            m.d.sync += self.temperature.eq(word)
        with m.If(writer.en & (r.place == WORDS.index("DIAG_STAT"))):
            m.d.sync += r.testing.eq(0)
            for bit in range(16):
                with m.If(r.testing if bit in TEST_BITS else 1):
                    m.d.sync += self.diag_stat[bit].eq(spi.o_data[bit])
        # One comparison for both signs: -limit or less is limit - 1 or more with all bits inverted.
        negative = spi.o_data[-1]
        magnitude = Cat(negative, spi.o_data[:-1] ^ negative.replicate(15))
        limit = Mux(r.place >= 3, 2 * FULL_SCALE[1] - 1, 2 * FULL_SCALE[0] - 1)
        full = ~r.place.all() & (magnitude >= limit)
        with m.If(writer.en):
            m.d.sync += [
                r.over.eq(~is_temperature & (r.over | full)),
                r.alarm.eq((spi.o_data & ALARM_MASK).any()),
                r.invalid.eq((spi.o_data & COMM_FAILURE).any()),
            ]

    def _wait(self, m: Module, r: _Registers) -> None:
        """The timer, which begins in the cycle after `_Registers.wait`; the count of edges.

        A tick is a change of a bit of ``time``, of a higher one for rarer samples.
        """
        tick = Signal()
        bits = [self.time[min(31, self.tick_bit + min(k, _DECIMATION_MAX))] for k in range(16)]
        bit, fast_before, slow_before = (Signal(name=f"tick_bit{k}") for k in range(3))
        slow = Array(bits)[r.used["smpl_prd"][8:12]]
        m.d.comb += bit.eq(Mux(r.running, slow, bits[0]))
        m.d.sync += [
            fast_before.eq(bits[0]),
            slow_before.eq(slow),
            tick.eq(bit ^ Mux(r.running, slow_before, fast_before)),
        ]
        m.d.comb += r.expired.eq(tick & r.done)
        m.d.sync += r.begin.eq(0)
        with m.If(r.begin):
            m.d.sync += [r.timer.eq(r.ticks), r.done.eq(r.ticks == 0)]
        with m.Elif(tick & ~r.done):
            m.d.sync += [r.timer.eq(r.timer - 1), r.done.eq(r.timer == 1)]
        with m.If(r.running & r.edge):
            m.d.sync += r.edges.eq(r.edges + 1)

    def _reset(self, m: Module, r: _Registers) -> None:
        """The reset pulse, in which settings are taken."""
        m.d.comb += r.ticks.eq(self.reset_ticks)
        m.d.sync += [used.eq(getattr(self, name)) for name, used in r.used.items()]
        m.d.sync += [*r.give_chances(), r.step.eq(FIRST), r.testing.eq(0)]
        with m.If(r.testing):  # it was cut short
            m.d.sync += r.test_next.eq(1)
        with m.If(r.expired):
            m.d.sync += r.wait()
            m.next = "STARTUP"
        with m.If(r.start_over):
            m.next = "RESET"

    def _next_frame(self, m: Module, r: _Registers) -> None:
        step = r.step
        with m.If(r.answered):
            m.d.sync += [step.eq(step + 1), *r.wait()]
            with m.If(step == LAST):
                m.d.sync += step.eq(Cat(r.checking, Const(0b110, 3)))
            with m.If(step[3:].all()):
                m.d.sync += step.eq(step | 4)
            with m.If(r.starts_test):
                m.d.sync += [step.eq(FIRST), r.test_next.eq(0), r.testing.eq(1)]
                m.next = "STARTUP"
            with m.If(r.ends):
                m.d.sync += [r.running.eq(1), r.extra[0].eq(self.command.valid & r.whole)]
                m.next = "EDGE"
        with m.If(r.start_over):
            m.next = "RESET"

    def _await_edge(self, m: Module, r: _Registers) -> None:
        """The next data-ready edge; before it a command and a request of the temperature."""
        m.d.sync += r.step.eq(Mux(r.extra[0], HOST, Mux(r.extra[1], TEMPERATURE, FIRST_RUN)))
        m.d.comb += self.command.ready.eq(r.extra[0] & self.spi.i.ready)
        with m.If(self.spi.i.ready):
            m.d.sync += r.extra.eq(r.extra << 1)
        with m.If(r.edge & ~self.spi.busy), m.If(~r.extra.any()):
            m.d.sync += [
                self.stamp.eq(self.time),
                self.number.eq(r.edges),
                self.flags.no_data_ready.eq(0),
            ]
            m.next = "FRAMES"
        with m.Elif(r.expired):
            m.d.sync += [*r.wait(), self.flags.no_data_ready.eq(1)]
            m.d.comb += r.event["no_data_ready"].eq(1)
        with m.If(r.start_over):
            m.next = "RESET"

    def _judge(self, m: Module, r: _Registers) -> None:
        """Judge sample and device by the checked reply; counts and flags of samples."""
        flags, event = self.flags, r.event
        judging, whole = r.judging, r.whole
        doubtful = Signal()
        bad = Signal()
        m.d.comb += doubtful.eq(flags.identity_error | flags.config_error)
        with m.If(judging):
            with m.If(r.which == CHECKED.index("PROD_ID")):
                m.d.comb += event["identity_error"].eq(~r.equal)
                m.d.sync += flags.identity_error.eq(~r.equal)
            with m.Else():
                m.d.comb += event["config_error"].eq(~r.equal)
                m.d.sync += flags.config_error.eq(~r.equal)
            with m.If(whole & r.equal):
                m.d.comb += [
                    event["link_error"].eq(r.invalid | doubtful),
                    event["sample"].eq(~r.invalid & ~doubtful),
                ]
                m.d.sync += [
                    r.checking.eq(r.checking + 1),
                    flags.link_error.eq(r.invalid | doubtful),
                ]
        m.d.comb += [
            event["overrun"].eq(r.edge & r.running & (self.spi.busy | r.spi_turn)),
            bad.eq(event["no_data_ready"] | (judging & whole & (~r.equal | r.invalid))),
            event["restart"].eq(self.restart | (bad & r.final) | (judging & ~whole & ~r.equal)),
        ]
        with m.If(event["sample"]):
            m.d.comb += [event["alarm"].eq(r.alarm), event["over_range"].eq(r.over)]
            m.d.sync += [
                flags.alarm.eq(r.alarm),
                flags.over_range.eq(r.over),
                flags.overrun.eq(r.skipped),
                r.skipped.eq(0),
                *r.give_chances(),
            ]
        with m.If(event["overrun"]):
            m.d.sync += r.skipped.eq(1)
        with m.If(bad):
            m.d.sync += [r.chances.eq(r.chances - 1), r.final.eq(r.chances == 1)]
        with m.If(r.start_over):
            m.d.sync += [*r.wait(), r.running.eq(0), r.extra.eq(0)]
        with m.If(self.restart):
            m.d.sync += r.test_next.eq(self.test_ticks > 0)

    def _frames(self, m: Module, r: _Registers) -> None:
        """The table of frames: command of ``step``, and use of its reply; a cycle after it."""
        row = Cat(r.command, r.writes, r.stores, r.place, r.checks, r.which, r.whole, r.ends)
        rows = 0
        for number, each in STEPS.items():
            word = read(each.register) if each.byte is None else write(each.register, each.byte, 0)
            whole = number > LAST and each.check is not None
            columns = (
                (word >> 8, r.command),
                (each.byte is not None, r.writes),
                (each.store is not None, r.stores),
                (each.store or 0, r.place),
                (each.check is not None, r.checks),
                (number if each.byte is None else CHECKED.index(each.register), r.which),
                (whole, r.whole),
                (whole or number == FIRST_RUN - 1, r.ends),
            )
            at = len(row) * number
            for value, column in columns:
                rows |= (value & (1 << len(column)) - 1) << at
                at += len(column)
        high = Signal()
        table = Const(rows, len(row) << len(r.step))
        m.d.sync += r.starts_test.eq(r.test_next & (r.step == TEST))
        m.d.sync += [row.eq(table.word_select(r.step, len(row))), high.eq(~r.step[0])]
        m.d.comb += self.spi.i.payload.eq(
            Cat(
                (r.known.word_select(high, 8) & r.writes.replicate(8))
                | (r.starts_test << (TEST_BYTE - 1).bit_length()),
                Mux(r.extra[0], self.command.payload[8:], r.command),
            )
        )


def _bits(*names: str) -> list[Signal]:
    return [Signal(name=name) for name in names]


class _Registers:
    """Registers of the reader, and signals between its parts."""

    def __init__(self, reader: Adis16385) -> None:
        self.step = Signal(5, init=FIRST)
        self.checking = Signal(range(len(CHECKED)))  # with this sample
        #: Settings written to the device.
        self.used = {name: Signal(16, name=f"{name}_used") for name in SETTINGS}
        # Of the frame whose reply comes.
        self.command = Signal(8)
        self.writes, self.stores, self.checks = _bits("writes", "stores", "checks")
        self.place = Signal(3)
        self.which = Signal(range(len(CHECKED)))
        self.known = Signal(16)
        self.whole = Signal()  # it ends a sample
        self.ends = Signal()  # a data-ready edge is next
        self.answered, self.storing, self.judging = _bits("answered", "storing", "judging")
        self.equal, self.spi_turn = _bits("equal", "spi_turn")
        self.extra = Signal(2)  # to send after a sample: the command, then a request
        self.test_next = Signal(init=reader.test_ticks > 0)  # the start ends with a self-test
        self.starts_test = Signal()  # the frame at work
        self.testing = Signal()  # it is made, its result is next
        self.edge, self.running, self.skipped = _bits("edge", "running", "skipped")
        self.over, self.alarm, self.invalid = _bits("over", "alarm", "invalid")
        self.event = {name: Signal(name=f"event_{name}") for name in EVENTS}
        waits = (reader.timeout_ticks, reader.startup_ticks, reader.reset_ticks, reader.test_ticks)
        self.timer = Signal(range(1 + max(waits)), init=reader.reset_ticks)
        self.done = Signal(init=reader.reset_ticks == 0)  # the timer is 0
        self.begin = Signal()
        self.ticks = Signal.like(self.timer, init=reader.timeout_ticks)  # to wait in this state
        self.expired = Signal()
        self.start_over = self.event["restart"]
        self.chances = Signal(range(reader.bad_limit), init=reader.bad_limit - 1)
        self.final = Signal(init=reader.bad_limit == 1)  # no chances are left
        self.edges = Signal(16)

    def wait(self) -> list[Any]:
        return [self.begin.eq(1), self.done.eq(0)]

    def give_chances(self) -> list[Any]:
        """All of them, after a good sample and at a new start."""
        return [self.chances.eq(self.chances.init), self.final.eq(self.final.init)]
