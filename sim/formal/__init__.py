"""Formal proofs of the gateware, by SymbiYosys.

A proof is a `harness.Harness` around the real component. It drives the inputs with words that the
solver chooses (`harness.unknown`) and states properties with ``Assert``,
``Assume`` and ``Cover``. Its docstring is the claim. A harness reads ports; only that of a proof by
induction, which begins in any state, reads registers. `docs/proofs.md` says what is proven and what
is not; ``make formal`` runs the proofs.
"""
