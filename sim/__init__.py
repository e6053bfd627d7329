"""Records, levels, comparison, closed loops, proofs, reports."""
