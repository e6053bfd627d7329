"""The covariance among an estimator's states.

A covariance is what the estimator says (`Estimator.covariance_elements`) or what its states are
named as: ``p00``, ``p01``, ``p11`` (or ``p_xx``, ``p_xy``), the upper or the lower half.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.step import called
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program

_ELEMENT = re.compile(r"p_?([0-9a-z])([0-9a-z])")


@dataclass(frozen=True)
class Covariance:
    """States that form a covariance: its axes, and (row, column, state) of each element."""

    axes: tuple[str, ...]
    elements: tuple[tuple[int, int, int], ...]

    def of_words(self, program: Program, states: IntArray) -> FloatArray:
        """Matrices (n, axes, axes) of state words (n, n_states), in the least LSB of them."""
        lsb = {k: program.format(program.states[k][0]).lsb for _, _, k in self.elements}
        p = np.zeros((len(states), len(self.axes), len(self.axes)))
        for i, j, k in self.elements:
            p[:, i, j] = p[:, j, i] = states[:, k] * (lsb[k] / min(lsb.values()))
        return p


def covariance_of(estimator: Estimator) -> Covariance:
    """The covariance among an estimator's states; without elements if there is none.

    An element counts where its two diagonal elements are states too, so a state ``pos`` is none.
    """
    names = [s.name for s in estimator.states]
    elements = dict(estimator.covariance_elements) or {
        name: (m[1], m[2]) for name in names if (m := _ELEMENT.fullmatch(name))
    }
    entries = [(*elements[name], k) for k, name in enumerate(names) if name in elements]
    axes = [i for i, j, _ in entries if i == j]
    return Covariance(
        tuple(axes),
        tuple((axes.index(i), axes.index(j), k) for i, j, k in entries if {i, j} <= {*axes}),
    )


def own_covariance(
    estimator: Estimator, states: Mapping[str, FloatArray], params: Mapping[str, float]
) -> tuple[tuple[str, ...], FloatArray] | None:
    """`Estimator.error_covariance`, checked: names, and covariances (n, k, k) for states (n,).

    InputError: the method raises, or returns something else.
    """
    where = f"estimator {estimator.name}, error_covariance"
    given = called(
        estimator.error_covariance,
        states,
        params,
        where=where,
        wanted="names and covariances",
        kind=tuple | None,
        answer="return (names, covariances) or None",
    )
    if given is None:
        return None
    known = {*states, *(o.name for o in estimator.outputs)}
    count = max(map(len, states.values()), default=0)
    wanted = f"names of states, and covariances of {count} records, each a matrix of them"
    fix = "return (names, covariances), an array (n, k, k) for k names"
    try:
        given_names, values = given
        names = (given_names,) if isinstance(given_names, str) else tuple(given_names)
        covariances: FloatArray = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        found = str(error) if len(given) == 2 else f"{len(given)} values"
        raise InputError.at(where, wanted=wanted, found=found, fix=fix) from None
    for name in names:
        require(name in known, where, wanted, f"the name {name!r}", fix)
    found = f"the shape {covariances.shape} of {len(names)} names"
    require(covariances.shape == (count, len(names), len(names)), where, wanted, found, fix)
    return names, covariances
