"""Formal proofs: harnesses around the components, and the runner that hands them to a solver.

A proof is an Amaranth `Elaboratable` (the harness) that holds the real component, drives its inputs
with `unknown` words, and says with ``Assert``, ``Assume`` and ``Cover`` what has to hold. Every
module of this package that has a tuple ``PROOFS`` of `prove.Proof` adds to the registry. What is
proven, and what is not, stands in `docs/proofs.md`; ``python -m boresight.sim.formal`` runs it.

A harness and its proof::

    class Counts(Elaboratable):
        def __init__(self, dut):
            self.dut = dut

        def elaborate(self, platform):
            m = Module()
            m.submodules.dut = dut = self.dut
            m.d.comb += dut.go.eq(unknown(m, 1, "go"))       # any input, any time
            m.d.comb += Assert(dut.count <= 9)               # in every cycle
            m.d.comb += Cover(dut.count == 9)                # it does get there
            return m

    PROOFS = (Proof(name="counter.range", claim="never above 9", depth=20, induction=2,
                    harness=lambda: Counts(Counter(limit=9))),)

    print(prove(PROOFS[0]).report())

Assertions stand in the domain ``comb``. A reset of ``sync`` may come in any cycle (`prove.Proof`).
Signals inside of a component are seen through attributes that it keeps for this purpose; harnesses
take the component as an argument, so that tests can hand them a broken one.
"""
