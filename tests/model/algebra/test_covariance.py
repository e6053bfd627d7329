"""Covariances."""

from boresight.model.algebra.covariance import downdated, element_names, symmetric
from boresight.model.lowering.trace import Scalar, Trace, Tracer


def test_a_skipped_downdate_costs_nothing_more() -> None:
    """Terms under a flag: one slot per product and one per element, in one group each."""
    from boresight.model.lowering.lower import lower
    from boresight.model.words.fixed import Arithmetic

    slots = []
    for skip in (False, True):
        g = Tracer("test")
        leaves: list[Scalar] = [g.leaf("input", f"x{k}", -0.5, 0.5) for k in range(10)]
        p = symmetric(2, lambda i, j, v=leaves: v[i + j])
        gains = [leaves[4:6], leaves[6:8]]
        done = downdated(p, gains, leaves[9] < 0.0 if skip else leaves[9] < -1.0)
        program = lower(
            Trace(g, leaves, {f"p{i}{j}": done[i][j] for _, i, j in element_names(2)}),
            Arithmetic(word=32),
        )[0]
        slots.append(sum(len(op.terms) for op in program.ops))
    assert slots[0] == slots[1]
