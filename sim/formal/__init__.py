"""Formal proofs of the gateware, by SymbiYosys.

A proof is a `harness.Harness` around the real component. It drives the inputs with words that the
solver chooses (`harness.unknown`, `harness.fixed`) and states properties with ``Assert``,
``Assume`` and ``Cover``. Its docstring is the claim. `docs/proofs.md` says what is proven and what
is not; ``python -m boresight.sim.formal`` runs the proofs::

    class Counts(Harness[Counter]):
        \"\"\"The count is never above 9.\"\"\"

        def surround(self, m, dut):
            drive(m, dut, "go")                    # any input, any time
            m.d.comb += Assert(dut.count <= 9)     # in every cycle
            m.d.comb += reached(m, dut.count == 9, "nine")  # it is reachable

    PROOFS = (Proof(name="counter.range", depth=20, harness=Counts, dut=Counter),)

A harness reads ports. Only that of a proof by induction (`inside.InductiveHarness`) reads
registers, since induction begins in any state.
"""
