"""Axles that met other rails than the others at the same places, which no right log shows.

Forward sums over the sections of the rails give the probability of what the axles met, if all were
on the same rails, or one of them on rails of its own. Over the way their logarithms add up to the
evidence for common rails. Where it falls by more than chance lets it, a torque does not act as the
log has it, columns are those of another axle, or the contact has another law.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.logs.friction import Rails

CLEAR = 30.0  # fall of the evidence that right logs do not have


class Conflict(NamedTuple):
    """An axle that met other rails than the others did, and where.

    Attributes
    ----------
    axle : int
        Its number.
    start, end : float
        Way on which the evidence for common rails falls [m].
    fall : float
        Logarithm of the ratio of probabilities: rails of its own over those of all axles [1].
    """

    axle: int
    start: float
    end: float
    fall: float


def conflicts(rails: Rails, likelihood: FloatArray) -> Iterator[Conflict]:
    """Each axle that is in conflict with the others.

    Parameters
    ----------
    rails : Rails
        Sections of the rails.
    likelihood : ndarray, shape (sections, axles, grid)
        Logarithms, at friction before the axles cleaned the rails.
    """
    axles, every = likelihood.shape[1], likelihood.sum(axis=1, keepdims=True)
    if axles == 1:
        return
    found = rails.evidence(np.concatenate([every, likelihood, every - likelihood], axis=1))
    together, alone, others = np.split(found, [1, 1 + axles], axis=1)
    evidence = np.cumsum(together - alone - others, axis=0)
    evidence = np.vstack([np.zeros(axles), evidence])
    for axle, along in enumerate(evidence.T, start=1):
        falls = np.maximum.accumulate(along) - along
        end = int(falls.argmax())
        if falls[end] > CLEAR:
            start = int(along[:end].argmax())
            yield Conflict(axle, rails.edges[start], rails.edges[end], float(falls[end]))
