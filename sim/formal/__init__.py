"""Formal proofs: harnesses around the components, and the runner that hands them to a solver.

A proof is an Amaranth `Elaboratable` (the harness) that contains the real component, drives its
inputs with `unknown` words, and states its properties with ``Assert``, ``Assume`` and ``Cover``.
Every module of this package with a tuple ``PROOFS`` of `prove.Proof` adds to the registry.
`docs/proofs.md` lists what is proven and what is not; ``python -m boresight.sim.formal`` runs it.

A harness and its proof::

    class Counts(Elaboratable):
        def __init__(self, dut):
            self.dut = dut

        def elaborate(self, platform):
            m = Module()
            m.submodules.dut = dut = self.dut
            m.d.comb += dut.go.eq(unknown(m, 1, "go"))       # any input, any time
            m.d.comb += Assert(dut.count <= 9)               # in every cycle
            m.d.comb += Cover(dut.count == 9)                # it is reachable
            return m

    PROOFS = (Proof(name="counter.range", claim="never above 9", depth=20, induction=2,
                    harness=lambda: Counts(Counter(limit=9))),)

    print(prove(PROOFS[0]).report())

Assertions are in the domain ``comb``. A reset of ``sync`` may come in any cycle (`prove.Proof`).
Signals inside a component are accessed with `inside.Inside`; harnesses take the component as an
argument, so that tests can pass a broken one.
"""
