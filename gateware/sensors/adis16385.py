"""Reader of the ADIS16385 inertial sensor: from reset to checked samples, and back after faults."""

from __future__ import annotations

from typing import Any, Final

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from boresight.gateware.sensors.adis16385_flags import EVENTS, FLAGS
from boresight.gateware.sensors.adis16385_frames import (
    CHECKED,
    COMM_FAILURE,
    CONFIG_FRAMES,
    FIRST,
    FIRST_RUN,
    IDENTITY,
    LAST,
    RUN_FRAMES,
    STEPS,
    WORDS,
    read,
    write,
)
from boresight.gateware.sensors.adis16385_range import at_full_scale
from boresight.gateware.serial.spi import SpiController, cycles_for

__all__ = ["Adis16385"]

#: Cycles from an edge at a pin until it is seen.
_SYNCHRONISER = 2
#: Cycles from a frame's answer to the sample.
_JUDGE = 2
#: Largest exponent of the decimation in SMPL_PRD.
_DECIMATION_MAX = 12


class Adis16385(wiring.Component):
    """Reads a whole sample at each data-ready edge, and gives it away only if it can be trusted.

    Start: reset pulse, wait, identity, settings (low byte, then high byte of each), all of them
    read back. Then 9 frames per sample: each asks for a register and brings what the frame before
    asked for. The first one brings the temperature, which is as of the sample before; the last one
    brings a register whose contents are known: identity and the three settings in turn
    (`CHECKED`). So stuck lines, a device that is absent, a slip of the pipeline, a device that was
    reset and forgot its settings: all of it shows as a wrong word there, and the sample is dropped.
    The same register is then checked until it is right again, and the first sample that passes is
    dropped as well: the fault may have ended in its middle. What no check can see is a fault that
    begins and ends between two of them: shorter than the time between samples.

    ``bad_limit`` samples in a row that are dropped or fail to come, or a wrong word during the
    start: the reader starts over from the reset pulse, for as long as it takes.

    DIAG_STAT: bits of ``alarm_mask`` raise the alarm, and the sample counts. Bits of
    ``invalid_mask`` drop it; by default the one that says that a frame had a wrong number of
    clocks, so that nobody knows which registers were read (a sibling part's bit).

    Waits are counted in ticks of ``tick_cycles`` from ``time``, in the time-out of ``2**D`` ticks
    with the decimation exponent D of SMPL_PRD (bits 11:8, up to 12; inferred from a sibling part).

    **Latency** ``sample`` comes `burst_cycles` after a data-ready edge.

    Parameters
    ----------
    clock_hz : float
        Clock of domain ``sync``, Hz.
    sclk_hz : float
        Highest SPI clock, Hz. 1 MHz is what the maker's own tool uses.
    stall_s : float
        Least pause between frames, s. 16 us is what the maker's own tool uses.
    startup_s : float
        Least wait from the end of the reset pulse to the first frame, s (unverified: 0.3).
    reset_s : float
        Least length of the reset pulse, s (unverified: 1 ms).
    period_s : float
        Nominal time between samples without decimation, s: 1/1024.
    timeout_periods : float
        Periods after which a data-ready edge counts as missing.
    bad_limit : int, 1 to 16
        Bad samples in a row that lead to a new start.
    identity : int
        PROD_ID.
    msc_ctrl, smpl_prd, sens_avg : int
        Settings before anybody drives the members of the same names: data-ready on DIO1, active
        high; 1024 samples/s; +-300 deg/s and a filter of 2**2 taps per stage.
    gyro_limit, accel_limit : int
        Full scale, counts: a magnitude from there on is over-range.
    alarm_mask, invalid_mask : int
        Bits of DIAG_STAT.

    Members
    -------
    cs_n, sclk, mosi, reset_n : Out(1)
        Pins.
    miso, data_ready : In(1)
        Pins, asynchronous to the clock.
    time : In(32)
        Counts clock cycles.
    enable : In(1)
        0: no new frame, the device is held in reset.
    restart : In(1)
        Start over, for example because of new settings. Settings are taken during the reset pulse.
    msc_ctrl, smpl_prd, sens_avg : In(16)
        Settings of the device.
    sample : Out(1)
        A checked sample is there, in this cycle.
    index : In(3), word : Out(16)
        Its words as in `WORDS`, combinational: 3 gyro, 3 accelerometer counts, temperature
        (sign-extended), DIAG_STAT.
    stamp : Out(32)
        ``time`` when its data-ready edge was seen, `stamp_delay` cycles after the edge.
    number : Out(16)
        Its number among the data-ready edges since the first start, modulo 2**16.
        Words, stamp and number hold for `hold_cycles` after ``sample``.
    temperature, diag_stat : Out(16)
        The latest of both that were read, good sample or not.
    flags : Out(len(FLAGS)), events : Out(len(EVENTS))
        See `gateware.sensors.adis16385_flags`.
    """

    EVENTS: Final = EVENTS
    FLAGS: Final = FLAGS

    def __init__(
        self,
        *,
        clock_hz: float,
        sclk_hz: float = 1e6,
        stall_s: float = 16e-6,
        startup_s: float = 0.3,
        reset_s: float = 1e-3,
        period_s: float = 1 / 1024,
        timeout_periods: float = 4.0,
        bad_limit: int = 4,
        identity: int = IDENTITY,
        msc_ctrl: int = 0x0006,
        smpl_prd: int = 0x0001,
        sens_avg: int = 0x0402,
        gyro_limit: int = 24_000,
        accel_limit: int = 20_000,
        alarm_mask: int = 0xFF7F,
        invalid_mask: int = COMM_FAILURE,
    ) -> None:
        words = {
            "identity": identity,
            "msc_ctrl": msc_ctrl,
            "smpl_prd": smpl_prd,
            "sens_avg": sens_avg,
            "alarm_mask": alarm_mask,
            "invalid_mask": invalid_mask,
        }
        for name, value, least, most in (
            *((name, value, 0, 0xFFFF) for name, value in words.items()),
            ("gyro_limit", gyro_limit, 1, 0x7FFF),
            ("accel_limit", accel_limit, 1, 0x7FFF),
            ("bad_limit", bad_limit, 1, 16),
        ):
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                raise ValueError(f"{name} must be an integer from {least} to {most}, not {value!r}")
        if isinstance(sclk_hz, bool) or not isinstance(sclk_hz, (int, float)) or not sclk_hz > 0:
            raise ValueError(f"sclk_hz must be a positive number, not {sclk_hz!r}")
        if not isinstance(timeout_periods, (int, float)) or not timeout_periods >= 1:
            raise ValueError(f"timeout_periods must be 1 or more, not {timeout_periods!r}")
        self.spi = SpiController(
            half_cycles=max(3, cycles_for(clock_hz=clock_hz, seconds=0.5 / sclk_hz)),
            stall_cycles=cycles_for(clock_hz=clock_hz, seconds=stall_s),
        )
        self.identity, self.bad_limit = identity, bad_limit
        self.gyro_limit, self.accel_limit = gyro_limit, accel_limit
        self.alarm_mask, self.invalid_mask = alarm_mask, invalid_mask
        timeout = cycles_for(clock_hz=clock_hz, seconds=timeout_periods * period_s)
        self.tick_bit = max(0, (timeout // 4).bit_length() - 1)
        self.timeout_ticks = self._ticks(timeout)
        self.reset_ticks = self._ticks(cycles_for(clock_hz=clock_hz, seconds=reset_s))
        self.startup_ticks = self._ticks(cycles_for(clock_hz=clock_hz, seconds=startup_s))
        period = cycles_for(clock_hz=clock_hz, seconds=period_s)
        if period <= self.burst_cycles + self.spi.stall_cycles:
            burst_s = self.burst_cycles / clock_hz
            raise ValueError(
                f"period_s must be longer than a burst ({burst_s:.4g} s and a stall), "
                f"not {period_s!r}"
            )
        super().__init__(
            {
                "cs_n": Out(1, init=1),
                "sclk": Out(1, init=1),
                "mosi": Out(1),
                "reset_n": Out(1),
                "miso": In(1),
                "data_ready": In(1),
                "time": In(32),
                "enable": In(1, init=1),
                "restart": In(1),
                "msc_ctrl": In(16, init=msc_ctrl),
                "smpl_prd": In(16, init=smpl_prd),
                "sens_avg": In(16, init=sens_avg),
                "sample": Out(1),
                "index": In(range(len(WORDS))),
                "word": Out(16),
                "temperature": Out(16),
                "diag_stat": Out(16),
                "stamp": Out(32),
                "number": Out(16),
                "flags": Out(FLAGS),
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
    def stamp_delay(self) -> int:
        """Clock cycles from a data-ready edge at the pin to the ``time`` that is its stamp."""
        return _SYNCHRONISER

    @property
    def burst_cycles(self) -> int:
        """Clock cycles from a data-ready edge at the pin to ``sample``."""
        return (
            _SYNCHRONISER
            + 1
            + (RUN_FRAMES - 1) * self.spi.frame_cycles
            + self.spi.answer_latency
            + _JUDGE
        )

    @property
    def hold_cycles(self) -> int:
        """Clock cycles for which a sample's words, stamp and number stay, from ``sample`` on."""
        return self.spi.stall_cycles - _JUDGE

    def check_cycles(self, period: int) -> int:
        """Most clock cycles until a fault that spoils answers has spoilt a check.

        With a sample each ``period`` cycles. For a fault in one of the `CHECKED` registers alone,
        as many periods more as there are others.
        """
        return period + self.burst_cycles

    @property
    def start_cycles(self) -> int:
        """Most clock cycles from a restart to ``flags.running``."""
        return (
            (self.reset_ticks + self.startup_ticks + 2) * self.tick_cycles
            + (CONFIG_FRAMES + 1) * self.spi.frame_cycles
            + 8
        )

    def timeout_cycles(self, decimation: int = 0) -> int:
        """Most clock cycles without data-ready edge until it is said to be missing."""
        return ((self.timeout_ticks + 1) * self.tick_cycles << decimation) + 1

    def detection_cycles(self, decimation: int = 0) -> int:
        """Most clock cycles from a good sample to a restart after ``bad_limit`` missing ones.

        See `check_cycles` for faults that spoil answers.
        """
        return self.burst_cycles + self.bad_limit * self.timeout_cycles(decimation) + 8

    def recovery_cycles(self, period: int, decimation: int = 0) -> int:
        """Most clock cycles from the end of a fault to the next good sample.

        Of a device that brings one each ``period`` cycles: a start that has just begun in vain is
        given up, the next one succeeds.
        """
        bad = self.bad_limit * max(self.timeout_cycles(decimation), period) + self.burst_cycles
        return 2 * self.start_cycles + bad + (len(CHECKED) + 1) * period + self.burst_cycles

    def elaborate(self, platform: Any) -> Module:
        """Pins and buffer, frames, judgement, and four states."""
        m = Module()
        m.submodules.spi = spi = self.spi
        m.d.comb += [
            self.cs_n.eq(spi.cs_n),
            self.sclk.eq(spi.sclk),
            self.mosi.eq(spi.mosi),
            spi.miso.eq(self.miso),
        ]
        ready, ready_before, edge = Signal(), Signal(), Signal()
        m.submodules.synchroniser = FFSynchronizer(self.data_ready, ready)
        m.d.sync += ready_before.eq(ready)
        m.d.comb += edge.eq(ready & ~ready_before)

        step = Signal(5, init=FIRST)
        checking = Signal(range(len(CHECKED)))  # with this sample
        settings = {
            name: Signal(16, name=f"{name}_used") for name in ("msc_ctrl", "smpl_prd", "sens_avg")
        }
        stores, checks, place, running = Signal(), Signal(), Signal(3), Signal()
        which, known = Signal(range(len(CHECKED))), Signal(16)
        m.d.comb += known.eq(Array([self.identity, *settings.values()])[which])
        self._frames(m, step, which, known, stores, checks, place)

        # One cycle after the answer: judged, stored, on to the next step.
        answered, equal = Signal(), Signal()
        m.d.sync += [answered.eq(spi.o_valid), equal.eq(spi.o_data == known)]
        m.submodules.buffer = buffer = memory.Memory(
            shape=16, depth=len(WORDS), init=[], attrs={"ram_style": "distributed"}
        )
        writer, reader = buffer.write_port(), buffer.read_port(domain="comb")
        is_temperature = place == WORDS.index("TEMP_OUT")
        m.d.comb += [
            writer.addr.eq(place),
            writer.en.eq(answered & stores),
            writer.data.eq(
                Cat(
                    spi.o_data[:12],
                    Mux(is_temperature, spi.o_data[11].replicate(4), spi.o_data[12:]),
                )
            ),
            reader.addr.eq(self.index),
            self.word.eq(reader.data),
        ]
        for at, latest in (("TEMP_OUT", self.temperature), ("DIAG_STAT", self.diag_stat)):
            with m.If(writer.en & (place == WORDS.index(at))):
                m.d.sync += latest.eq(writer.data)
        over, alarm, invalid, skipped = Signal(), Signal(), Signal(), Signal()
        with m.If(writer.en):
            m.d.sync += [
                over.eq(
                    ~is_temperature
                    & (
                        over
                        | (
                            ~place.all()
                            & at_full_scale(
                                spi.o_data, place >= 3, (self.gyro_limit, self.accel_limit)
                            )
                        )
                    )
                ),
                alarm.eq((spi.o_data & self.alarm_mask).any()),
                invalid.eq((spi.o_data & self.invalid_mask).any()),
            ]

        event = {name: Signal(name=f"event_{name}") for name in EVENTS}
        m.d.sync += [self.events.eq(Cat(event.values())), self.sample.eq(event["sample"])]
        timer = Signal(
            range(1 + max(self.timeout_ticks, self.startup_ticks, self.reset_ticks)),
            init=self.reset_ticks,
        )
        tick, expired = Signal(), Signal()
        self._tick(m, tick, running, settings["smpl_prd"][8:12])
        m.d.comb += expired.eq(tick & (timer == 0))
        with m.If(tick & (timer != 0)):
            m.d.sync += timer.eq(timer - 1)
        chances = Signal(range(self.bad_limit), init=self.bad_limit - 1)
        bad, start_over = Signal(), Signal()
        edges = Signal(16)
        with m.If(running & edge):
            m.d.sync += edges.eq(edges + 1)
        flags = self.flags
        judging, spi_turn = Signal(), Signal()
        m.d.comb += judging.eq(checks & answered & spi_turn)

        with m.FSM() as fsm:
            with m.State("RESET"):
                m.d.sync += [used.eq(getattr(self, name)) for name, used in settings.items()]
                m.d.sync += [chances.eq(self.bad_limit - 1), step.eq(FIRST)]
                with m.If(expired):
                    m.d.sync += timer.eq(self.startup_ticks)
                    m.next = "STARTUP"
                with m.If(start_over):
                    m.next = "RESET"
            with m.State("STARTUP"):
                with m.If(start_over):
                    m.next = "RESET"
                with m.Elif(expired & ~spi.busy):
                    m.next = "FRAMES"
            with m.State("FRAMES"):
                m.d.comb += spi_turn.eq(1)
                with m.If(answered):
                    m.d.sync += [step.eq(step + 1), timer.eq(self.timeout_ticks)]
                    with m.If(step == LAST):
                        m.d.sync += step.eq(Cat(checking, Const(0b110, 3)))
                    with m.If(step[3:].all()):
                        m.d.sync += step.eq(step | 4)
                    with m.If((step == FIRST_RUN - 1) | step[2:].all()):
                        m.next = "EDGE"
                with m.If(start_over):
                    m.next = "RESET"
            with m.State("EDGE"):
                m.d.sync += step.eq(FIRST_RUN)
                with m.If(edge & ~spi.busy):
                    m.d.sync += [
                        self.stamp.eq(self.time),
                        self.number.eq(edges),
                        flags.no_data_ready.eq(0),
                    ]
                    m.next = "FRAMES"
                with m.Elif(expired):
                    m.d.sync += [timer.eq(self.timeout_ticks), flags.no_data_ready.eq(1)]
                    m.d.comb += event["no_data_ready"].eq(1)
                with m.If(start_over):
                    m.next = "RESET"

        # Judgement: at the answer that is checked.
        whole, doubtful = Signal(), Signal()
        m.d.comb += [
            whole.eq(step[2:].all()),
            doubtful.eq(flags.identity_error | flags.config_error),
        ]
        with m.If(judging):
            with m.If(step[:2] == 0):
                m.d.comb += event["identity_error"].eq(~equal)
                m.d.sync += flags.identity_error.eq(~equal)
            with m.Else():
                m.d.comb += event["config_error"].eq(~equal)
                m.d.sync += flags.config_error.eq(~equal)
            with m.If(whole & equal):
                m.d.comb += [
                    event["link_error"].eq(invalid | doubtful),
                    event["sample"].eq(~invalid & ~doubtful),
                ]
                m.d.sync += [checking.eq(checking + 1), flags.link_error.eq(invalid | doubtful)]
        with m.If(event["sample"]):
            m.d.comb += [event["alarm"].eq(alarm), event["over_range"].eq(over)]
            m.d.sync += [
                flags.alarm.eq(alarm),
                flags.over_range.eq(over),
                flags.overrun.eq(skipped),
                skipped.eq(0),
                chances.eq(self.bad_limit - 1),
            ]
        m.d.comb += [
            event["overrun"].eq(edge & running & (spi.busy | fsm.ongoing("FRAMES"))),
            bad.eq(event["no_data_ready"] | (judging & whole & (~equal | invalid))),
            event["restart"].eq(
                self.enable & (self.restart | (bad & (chances == 0)) | (judging & ~whole & ~equal))
            ),
            start_over.eq(event["restart"] | ~self.enable),
        ]
        with m.If(event["overrun"]):
            m.d.sync += skipped.eq(1)
        with m.If(bad):
            m.d.sync += chances.eq(chances - 1)
        with m.If(start_over):
            m.d.sync += timer.eq(self.reset_ticks)
        m.d.comb += [
            running.eq(fsm.ongoing("EDGE") | (fsm.ongoing("FRAMES") & step[4])),
            flags.running.eq(running),
            spi.i.valid.eq(fsm.ongoing("FRAMES")),
        ]
        m.d.sync += self.reset_n.eq(~fsm.ongoing("RESET"))
        return m

    def _frames(
        self,
        m: Module,
        step: Signal,
        which: Signal,
        known: Signal,
        stores: Signal,
        checks: Signal,
        place: Signal,
    ) -> None:
        """The table of frames: command of ``step``, and what its answer is."""
        writes = Signal()
        with m.Switch(step):
            for number, each in STEPS.items():
                with m.Case(number):
                    command = (
                        read(each.register)
                        if each.byte is None
                        else write(each.register, each.byte, 0)
                    )
                    m.d.comb += [
                        self.spi.i.payload[8:].eq(command >> 8),
                        writes.eq(each.byte is not None),
                        stores.eq(each.store is not None),
                        place.eq(each.store or 0),
                        checks.eq(each.check is not None),
                        which.eq(number if each.byte is None else CHECKED.index(each.register)),
                    ]
        m.d.comb += self.spi.i.payload[:8].eq(known.word_select(~step[0], 8) & writes.replicate(8))

    def _tick(self, m: Module, tick: Signal, running: Signal, exponent: Value) -> None:
        """A tick at each change of a bit of ``time``: of a higher one, the rarer samples are."""
        bits = [self.time[min(31, self.tick_bit + min(k, _DECIMATION_MAX))] for k in range(16)]
        bit, before, ran = Signal(), Signal(), Signal()
        m.d.comb += bit.eq(Mux(running, Array(bits)[exponent], bits[0]))
        m.d.sync += [before.eq(bit), ran.eq(running)]
        # The change to another bit is no tick.
        m.d.comb += tick.eq((bit ^ before) & (ran == running))
