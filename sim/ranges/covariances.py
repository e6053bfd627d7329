"""Random covariances in place of those that runs reach.

|P_ij| <= sd_i sd_j (Cauchy-Schwarz) is no property of one state, and no interval expresses it. So
claims that depend on a covariance are also tried with random ones, of any rank and size within the
ranges of the states. No run need reach these: a claim that holds for all of them is safer than one
that holds in runs alone, and one that does not is no fault.
"""

from __future__ import annotations

import numpy as np

from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.accuracy.covariance import Covariance

__all__ = ["RandomCovariances"]

#: Binades that variances span below their largest.
BINADES = 16.0


class RandomCovariances:
    """Random covariances for the states of a program.

    Parameters
    ----------
    covariance : Covariance
        Which states are its elements.
    program : Program
    """

    def __init__(self, covariance: Covariance, program: Program) -> None:
        self.elements = covariance.elements
        self.formats = [program.format(program.states[k][0]) for _, _, k in self.elements]
        high = {i: program.values[program.states[k][0]].high for i, j, k in self.elements if i == j}
        self.max_variances = np.array([high[i] for i in range(len(covariance.axes))])[:, None]

    def states(self, rng: np.random.Generator, states: IntArray) -> IntArray:
        """Replace the covariances in state words (n_states, runs)."""
        n, runs = len(self.max_variances), states.shape[1]
        share = 2.0 ** -(BINADES * rng.random((n, runs)) * rng.integers(0, 2, (n, runs)))
        share /= np.maximum(share.sum(axis=0), 1.0)  # so that correlated sums stay in their ranges
        # Rows of unit length make a correlation matrix of their rank, or of a smaller one.
        rows = rng.normal(size=(n, n, runs))
        rows *= np.arange(n)[None, :, None] < rng.integers(1, n + 1, runs)
        rows /= np.maximum(np.sqrt((rows * rows).sum(axis=1, keepdims=True)), 1e-30)
        rows *= np.sqrt(share * self.max_variances)[:, None, :]
        drawn = states.copy()
        for (i, j, k), form in zip(self.elements, self.formats, strict=True):
            drawn[k] = form.quantise((rows[i] * rows[j]).sum(axis=0))
        return drawn
