"""Proof of the memory of results: `gateware.attitude.bus.results`."""

from __future__ import annotations

from amaranth.hdl import Assert, Assume, Cat, Module, Signal

from boresight.gateware.attitude.bus.results import INDEX_BITS, Results
from boresight.sim.formal.harness import before, fixed, reached, unknown
from boresight.sim.formal.inside import InductiveHarness, Inside
from boresight.sim.formal.prove import Proof


class ResultsHarness(InductiveHarness[Results]):
    """Results: all words that a reader sees between two takes are those of one update.

    It is the update that was the newest at the first take; the writer never waits. One word is
    followed. Its index is any, but stays the same: so what holds for it holds for each, and, as the
    updates are numbered, for all words of an update together.
    """

    def surround(self, m: Module, dut: Results) -> None:
        """The word in the update that is written, the newest, and each reader's."""
        inside = self.inside
        word = dut.word
        complete, w_en = (unknown(m, 1, n) for n in ("complete", "w_en"))
        w_index, w_data = unknown(m, INDEX_BITS, "w_index"), unknown(m, word, "w_data")
        m.d.comb += [
            dut.complete.eq(complete),
            dut.w_en.eq(w_en),
            dut.w_index.eq(w_index),
            dut.w_data.eq(w_data),
        ]
        # No word is written, and no update complete, in the cycle after `complete`.
        writing = Signal(init=1)
        m.d.sync += writing.eq(~complete)
        m.d.comb += Assume(~(w_en | complete) | writing)

        index = fixed(m, INDEX_BITS, "index")
        # Each is the word, and whether the update has written it.
        now, newest = Signal(1 + word, name="word_now"), Signal(1 + word, name="word_newest")
        hit = w_en & (w_index == index)
        next_word = Signal(1 + word)
        m.d.comb += next_word.eq(now)
        with m.If(hit):
            m.d.comb += next_word.eq(Cat(w_data, 1))
        m.d.sync += now.eq(next_word)
        with m.If(complete):
            m.d.sync += [newest.eq(next_word), now.eq(0)]
        write, bank_newest = inside["write"], inside["newest"]
        m.d.comb += [
            Assert(~writing | (write != bank_newest)),
            reached(m, complete & next_word[-1], "completed"),
        ]
        self.writing, self.index, self.now, self.newest = writing, index, now, newest
        for k in range(len(dut.ports)):
            self._reader(m, inside, k)

    def _reader(self, m: Module, inside: Inside, k: int) -> None:
        """A reader, its word, and its memory."""
        port, word, write = self.dut.ports[k], self.dut.word, inside["write"]
        writing, index, now, newest = self.writing, self.index, self.now, self.newest
        stored_word = Signal(1 + word, name=f"word_held{k}")
        take, r_index = unknown(m, 1, f"take{k}"), unknown(m, INDEX_BITS, f"index{k}")
        m.d.comb += [port.take.eq(take), port.index.eq(r_index)]
        with m.If(take):
            m.d.sync += stored_word.eq(newest)
        index_matches = before(m, r_index == index, f"looked{k}")
        expected = before(m, stored_word, f"wanted{k}")
        bank = inside[f"held{k}"]
        m.d.comb += [
            Assert(~(index_matches & expected[-1]) | (port.value == expected[:-1])),
            reached(m, index_matches & expected[-1] & writing, f"read{k}"),
            Assert(~writing | (write != bank)),
        ]
        for name, bank_number, content in (
            ("write", write, now),
            ("newest", inside["newest"], newest),
            ("held", bank, stored_word),
        ):
            stored = inside.word(f"copy{k}", Cat(index, bank_number))
            m.d.comb += Assert(
                ~content[-1] | (stored == content[:-1]) | (~writing if name == "write" else 0)
            )


PROOFS = (
    Proof(
        name="results.whole",
        harness=ResultsHarness,
        dut=lambda: Results(word=2, readers=2),
        depth=3,
        induction=True,
        cover=14,
        reset=False,
    ),
)
