"""A check, not a proof, of claims that depend on a matrix of states being a covariance.

|P_ij| <= sd_i sd_j (Cauchy-Schwarz) is no property of one state, and no interval expresses it.
Therefore random covariances, of any rank and size within the ranges of the states, replace those
that runs reached; a claim passes if it holds in the next update of all of them, and the next matrix
is again a covariance, but for rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.accuracy.covariance import Covariance, covariance_of
from boresight.sim.ranges.claims import Claim, live
from boresight.sim.ranges.search import Search

__all__ = ["check_on_covariances"]

FloatArray = npt.NDArray[np.float64]

#: Binades that variances span below their largest; errors of an element that rounding explains.
_BINADES, _ROUNDING = 16.0, 4.0


def check_on_covariances(
    estimator: Estimator,
    program: Program,
    nodes: Mapping[int, Node],
    claims: Sequence[Claim],
    updates: int,
) -> dict[int, str]:
    """Kind of random covariances on which each claim that depends on a covariance holds, by index.

    Empty without a covariance, or if the next matrix is no covariance.
    """
    try:
        covariance = covariance_of(estimator)
    except InputError:
        return {}
    states = {program.states[k][0] for _, _, k in covariance.elements}
    dependent = _dependent(program, nodes, claims, states)
    out: dict[int, str] = {}
    for limit_sum in (False, True):
        remaining = [k for k in dependent if k not in out]
        draw = RandomCovariances(covariance, program, limit_sum=limit_sum)
        search = Search(
            estimator, program, nodes, [claims[k] for k in remaining], drawn_states=draw.states
        )
        is_invariant = True
        for _ in range(updates if remaining else 0):
            search.run(1)
            is_invariant = is_invariant and draw.is_covariance(search.states)
        limits = "variances that add up to one range" if limit_sum else "variances in their ranges"
        if is_invariant:
            how = f"random covariances, {limits}"
            out |= {k: how for k, v in zip(remaining, search.violations, strict=True) if not v}
    return out


def _dependent(
    program: Program, nodes: Mapping[int, Node], claims: Sequence[Claim], states: set[int]
) -> list[int]:
    """Claims whose values depend on some of the states."""
    leaves = {nodes[n].number for n in states}
    return [
        k for k, claim in enumerate(claims) if leaves & {node.number for node in live([claim.node])}
    ]


class RandomCovariances:
    """Random covariances that replace those of the runs.

    Parameters
    ----------
    limit_sum : bool
        Whether the variances, as shares of their largest, add up to one at most.
    """

    def __init__(self, covariance: Covariance, program: Program, *, limit_sum: bool) -> None:
        self.limit_sum = limit_sum
        self.elements = covariance.elements
        self.formats = [program.format(program.states[k][0]) for _, _, k in self.elements]
        self.axes = len(covariance.axes)
        high = {i: program.values[program.states[k][0]].high for i, j, k in self.elements if i == j}
        self.max_variances = np.array([high[i] for i in range(self.axes)])[:, None]

    def states(self, rng: np.random.Generator, states: IntArray) -> IntArray:
        """State words (n_states, runs) with other covariances."""
        n, runs = self.axes, states.shape[1]
        share = 2.0 ** -(_BINADES * rng.random((n, runs)) * rng.integers(0, 2, (n, runs)))
        if self.limit_sum:
            share /= np.maximum(share.sum(axis=0), 1.0)
        # Rows of unit length: a correlation matrix of their rank, or of a smaller one.
        rows = rng.normal(size=(n, n, runs))
        rows *= np.arange(n)[None, :, None] < rng.integers(1, n + 1, runs)
        rows *= 4.0 ** -(4.0 * rng.random((n, n, runs)) * rng.integers(0, 2, runs))
        rows /= np.maximum(np.sqrt((rows * rows).sum(axis=1, keepdims=True)), 1e-30)
        rows *= np.sqrt(share * self.max_variances)[:, None, :]
        out = states.copy()
        for (i, j, k), form in zip(self.elements, self.formats, strict=True):
            out[k] = form.quantise((rows[i] * rows[j]).sum(axis=0))
        return out

    def is_covariance(self, states: IntArray) -> bool:
        """Whether the matrices of state words (n_states, runs) are covariances, up to rounding."""
        p = np.zeros((states.shape[1], self.axes, self.axes))
        lsb = np.zeros((self.axes, self.axes))
        for (i, j, k), form in zip(self.elements, self.formats, strict=True):
            p[:, i, j] = p[:, j, i] = form.real(states[k])
            lsb[i, j] = lsb[j, i] = form.lsb
        diagonal = np.arange(self.axes)
        p[:, diagonal, diagonal] += _ROUNDING * self.axes * lsb.sum(axis=1)
        sd = np.sqrt(np.maximum(p[:, diagonal, diagonal], 1e-300))
        return bool((np.linalg.eigvalsh(p / (sd[:, :, None] * sd[:, None, :])) > -1e-9).all())
