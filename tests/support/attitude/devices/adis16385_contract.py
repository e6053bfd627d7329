"""What the reader of the ADIS16385 must have done, recomputed from what happened at its pins.

Written from the reader's contract, in records of whole frames, not from its gateware. Everything is
exact to the cycle but the waits that are counted in ticks, which have bounds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from boresight.gateware.attitude.sensors.adis16385 import Adis16385

CHECKED: Final = (0x56, 0x34, 0x36, 0x38)
SENSORS: Final = (0x04, 0x06, 0x08, 0x0A, 0x0C, 0x0E)


class ContractBroken(AssertionError):
    """The reader did something else than it had to."""


def _signed(word: int, bits: int = 16) -> int:
    word &= (1 << bits) - 1
    return word - (1 << bits) if word >> bits - 1 else word


@dataclass
class Contract:
    """A reader by its contract. Feed it all inputs in order; compare `events`, `flags`, `samples`.

    ``reset``, ``overdue`` are outputs whose exact time the contract leaves open: they are taken
    from the trace, and checked against their bounds.

    Attributes
    ----------
    events : dict
        Cycle: names of events.
    flags : list of (int, frozenset of str)
        Changes.
    samples : list of (int, int, int, tuple of int)
        Cycle, stamp, number, words.
    """

    reader: Adis16385
    settings: tuple[int, int, int]
    events: dict[int, set[str]] = field(default_factory=dict)
    flags: list[tuple[int, frozenset[str]]] = field(default_factory=list)
    samples: list[tuple[int, int, int, tuple[int, ...]]] = field(default_factory=list)

    state: str = "reset"  # reset, startup, start, edge, burst
    waits_since: int = 0  # cycle in which the wait of the state began
    taken: tuple[int, int, int] = (0, 0, 0)  # settings in use
    enabled: bool = True
    frame: int = 0  # of the start or of the burst, the next one to begin
    turn: int = 0  # which of the known registers is checked
    idle_from: int = 0  # cycle from which the SPI takes a command
    edges: int = 0
    chances: int = 0
    stamp: int = 0
    number: int = 0
    words: list[int] = field(default_factory=lambda: [0] * 8)
    skipped: bool = False
    runs_from: int = 0  # cause of the first cycle in which samples are read
    runs_until: int = -1  # last cycle of this
    now_set: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.chances = self.reader.settings.bad_limit
        self.idle_from = self.reader.spi.stall_cycles - 1

    # -- helpers --------------------------------------------------------------------------------
    def _event(self, cause: int, name: str) -> None:
        self.events.setdefault(cause + 1, set()).add(name)

    def _flag(self, visible: int, **changes: bool) -> None:
        for name, on in changes.items():
            (self.now_set.add if on else self.now_set.discard)(name)
        new = frozenset(self.now_set)
        if self.flags and self.flags[-1][0] == visible:
            self.flags.pop()
        if new != (self.flags[-1][1] if self.flags else frozenset()):
            self.flags.append((visible, new))

    def _start_over(self, cause: int) -> None:
        if self.running:
            self.runs_until = cause
        self.state, self.waits_since = "reset", cause
        self.chances = self.reader.settings.bad_limit
        self._flag(cause + 1, running=False)

    def _bad(self, cause: int) -> None:
        self.chances -= 1
        if self.chances == 0:
            self._event(cause, "restart")
            self._start_over(cause)

    @property
    def running(self) -> bool:
        """Whether samples are being read."""
        return self.state in ("edge", "burst")

    # -- inputs ---------------------------------------------------------------------------------
    def edge(self, pin: int) -> None:
        """Data-ready rises at the pin."""
        seen = pin + self.reader.stamp_delay
        # A change of state shows in the cycle after its cause.
        if not (self.running and seen > self.runs_from) and seen != self.runs_until:
            return
        if self.state == "edge" and seen >= self.idle_from:
            self.stamp, self.number = seen & 0xFFFFFFFF, self.edges & 0xFFFF
            self.state, self.frame, self.idle_from = "burst", 0, seen + 1
            self._flag(seen + 1, no_data_ready=False)
        else:
            self._event(seen, "overrun")
            self.skipped = True
        self.edges += 1

    def restart(self, cycle: int) -> None:
        """The input ``restart`` is high."""
        if self.enabled:
            self._event(cycle, "restart")
            self._start_over(cycle)

    def enable(self, cycle: int, on: bool) -> None:
        """The input ``enable`` changes."""
        self.enabled = on
        if not on:
            self._start_over(cycle)
        else:
            self.waits_since = cycle - 1  # the wait begins with the last cycle in which it was 0

    def command(self) -> int:
        """What the next frame has to send."""
        settings = [byte for word in self.taken for byte in (word & 0xFF, word >> 8)]
        if self.state == "start":
            writes = [
                0x8000 | address << 8 | byte
                for address, byte in zip(range(0x34, 0x3A), settings, strict=True)
            ]
            return [0x5600, 0x5600, *writes, 0x5600, 0x3400, 0x3600, 0x3800, 0x1000][self.frame]
        row = [*SENSORS, 0x3C, CHECKED[self.turn], 0x10]
        return row[self.frame] << 8

    def begins(self, falls: int) -> None:
        """Chip select falls."""
        if self.state not in ("start", "burst"):
            raise ContractBroken(f"{falls}: a frame in state {self.state}")
        if falls != self.idle_from + 1:
            raise ContractBroken(f"{falls}: frame, wanted at {self.idle_from + 1}")

    def ends(self, rises: int, sent: int, came: int, aborted: bool) -> None:
        """Chip select rises; ``aborted``: the frame began before the last new start."""
        self.idle_from = rises + self.reader.spi.stall_cycles - 1
        if aborted:
            return
        if sent != self.command():
            raise ContractBroken(f"{rises}: sent {sent:04x}, wanted {self.command():04x}")
        judged = rises + 1
        known = (self.reader.settings.identity, *self.taken)
        if self.state == "start":
            check = {1: 0, 9: 0, 10: 1, 11: 2, 12: 3}.get(self.frame)
            if check is not None:
                good = came == known[check]
                self._check(judged, check, good)
                if not good:
                    self._event(judged, "restart")
                    self._start_over(judged)
                    return
            self.frame += 1
            if self.frame == 13:
                self._await_edge(judged)
                self.runs_from = judged
                self._flag(judged + 1, running=True)
            return
        if self.frame == 0:
            self.words[6] = _signed(came, 12)
        elif self.frame <= 6:
            self.words[self.frame - 1] = _signed(came)
        elif self.frame == 7:
            self.words[7] = came
        else:
            self._judge(judged, came == known[self.turn])
            return
        self.frame += 1

    def _await_edge(self, cause: int) -> None:
        self.state, self.waits_since = "edge", cause

    def _check(self, judged: int, check: int, good: bool) -> None:
        name = "config_error" if check else "identity_error"
        if not good:
            self._event(judged, name)
        self._flag(judged + 1, **{name: not good})

    def _judge(self, judged: int, good: bool) -> None:
        doubtful = bool(self.now_set & {"identity_error", "config_error"})
        self._check(judged, self.turn, good)
        self._await_edge(judged)
        if not good:
            self._bad(judged)
            return
        self.turn = (self.turn + 1) % 4
        diag = self.words[7]
        invalid = bool(diag & self.reader.settings.invalid_mask)
        self._flag(judged + 1, link_error=invalid or doubtful)
        if invalid or doubtful:
            self._event(judged, "link_error")
            if invalid:
                self._bad(judged)
            return
        self._event(judged, "sample")
        over = any(
            abs(word) >= limit
            for words, limit in (
                (self.words[:3], self.reader.settings.gyro_limit),
                (self.words[3:6], self.reader.settings.accel_limit),
            )
            for word in words
        )
        alarm = bool(diag & self.reader.settings.alarm_mask)
        for name, on in (("over_range", over), ("alarm", alarm)):
            if on:
                self._event(judged, name)
        self._flag(judged + 1, alarm=alarm, over_range=over, overrun=self.skipped)
        self.skipped = False
        self.chances = self.reader.settings.bad_limit
        self.samples.append(
            (judged + 1, self.stamp, self.number, tuple(word & 0xFFFF for word in self.words))
        )

    # -- outputs whose time has bounds ----------------------------------------------------------
    def _waited(self, now: int, ticks: int, what: str, exponent: int = 0) -> None:
        tick = self.reader.tick_cycles << exponent
        waited = now - self.waits_since
        if not ticks * tick <= waited <= (ticks + 1) * tick + 1:
            raise ContractBroken(
                f"{now}: {what} after {waited} cycles, wanted {ticks * tick} to "
                f"{(ticks + 1) * tick}"
            )

    @property
    def exponent(self) -> int:
        """Of the decimation."""
        return min(self.taken[1] >> 8 & 15, 12)

    def overdue(self, visible: int) -> None:
        """The event no_data_ready is there."""
        cause = visible - 1
        if self.state != "edge":
            raise ContractBroken(f"{visible}: no_data_ready in state {self.state}")
        self._waited(cause, self.reader.timeout_ticks, "no_data_ready", self.exponent)
        self._event(cause, "no_data_ready")
        self._flag(visible, no_data_ready=True)
        self.waits_since = cause
        self._bad(cause)

    def reset_ends(self, pin: int) -> None:
        """The reset pin rises."""
        cause = pin - 2
        if self.state != "reset" or not self.enabled:
            raise ContractBroken(f"{pin}: reset ends in state {self.state}")
        self._waited(cause, self.reader.reset_ticks, "end of reset")
        self.state, self.waits_since = "startup", cause
        self.taken = self.settings

    def start_begins(self, falls: int) -> None:
        """Chip select falls for the first time after a reset."""
        cause = falls - 2
        self._waited(cause, self.reader.startup_ticks, "first frame")
        self.state, self.frame, self.idle_from = "start", 0, falls - 1

    def hung(self, now: int) -> bool:
        """Whether something is overdue at ``now``."""
        ticks = {
            "reset": self.reader.reset_ticks,
            "startup": self.reader.startup_ticks,
            "edge": self.reader.timeout_ticks,
        }.get(self.state)
        if ticks is None:
            return now > self.idle_from + 2 * self.reader.spi.frame_cycles
        exponent = self.exponent if self.state == "edge" else 0
        return self.enabled and now > self.waits_since + 4 + (
            (ticks + 1) * self.reader.tick_cycles << exponent
        )
