"""Registers for inputs of estimators without a sensor; an update reads them as one set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["FeedRegisters"]


class FeedRegisters(wiring.Component):
    """Words that are written one by one, then copied to the update controller's memory together.

    ``take`` starts the copy. Until its last word, ``busy`` is high and nothing can be written. The
    words are copied while no estimator is being fed, so that every update reads one complete set.

    **Latency** the words of a set are there `count` + 2 cycles after ``take`` and ``free``, and one
    more for each cycle without ``ready``.

    Parameters
    ----------
    word : int
        W.
    init : sequence of int
        Initial words, one for each register.

    Members
    -------
    w_en : In(1), w_index : In(5), w_data : In(W)
        Write a word; not while ``busy``.
    take : In(1), busy : Out(1)
        Copy the set of words; the copy is under way.
    free : In(1)
        A copy may begin.
    valid : Out(1), index : Out(5), data : Out(W), ready : In(1)
        A word for the update controller's memory.
    done : Out(1)
        The word of this cycle completes the set.
    """

    def __init__(self, *, word: int, init: Sequence[int]) -> None:
        if not 1 <= len(init) <= 32:
            raise ValueError(f"init must have 1 to 32 words, not {len(init)}")
        self.word = word
        self.init = tuple(init)
        super().__init__(
            {
                "w_en": In(1),
                "w_index": In(5),
                "w_data": In(word),
                "take": In(1),
                "busy": Out(1),
                "free": In(1),
                "valid": Out(1),
                "index": Out(5),
                "data": Out(word),
                "ready": In(1),
                "done": Out(1),
            }
        )

    @property
    def count(self) -> int:
        """Number of registers."""
        return len(self.init)

    def elaborate(self, platform: Any) -> Module:
        """A memory, and a counter through it."""
        m = Module()
        mask = (1 << self.word) - 1
        m.submodules.words = words = memory.Memory(
            shape=self.word,
            depth=32,
            init=[word & mask for word in self.init],
            attrs={"ram_style": "distributed"},
        )
        w_port = words.write_port()
        r_port = words.read_port()
        wanted = Signal()
        going = Signal()
        following = Signal.like(self.index)
        last = self.index == self.count - 1
        m.d.comb += [
            w_port.addr.eq(self.w_index),
            w_port.data.eq(self.w_data),
            w_port.en.eq(self.w_en & ~self.busy),
            r_port.addr.eq(following),
            following.eq(Mux(self.valid, self.index + self.ready, Const(0, 5))),
            self.data.eq(r_port.data),
            self.valid.eq(going),
            self.busy.eq(wanted | going),
            self.done.eq(going & self.ready & last),
        ]
        m.d.sync += self.index.eq(following)
        with m.If(self.take):
            m.d.sync += wanted.eq(1)
        with m.If(wanted & self.free & ~going):
            m.d.sync += [going.eq(1), wanted.eq(0)]
        with m.If(self.done):
            m.d.sync += going.eq(0)
        return m
