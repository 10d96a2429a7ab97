"""Profiles of many wheelsets, read together as time goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactlib.parameters import FloatArray
from contactlib.profile import Profile


class ManyProfiles:
    """A profile over time for each wheelset; what they share is worked out once.

    Parameters
    ----------
    profiles : sequence of Profile
        One for each wheelset.
    """

    def __init__(self, profiles: Sequence[Profile]) -> None:
        distinct: dict[Profile, list[int]] = {}
        for i, profile in enumerate(profiles):
            distinct.setdefault(profile, []).append(i)
        self._steady = np.array([profile.value[0] for profile in profiles], dtype=np.float64)
        self._moving = [
            (profile, places) for profile, places in distinct.items() if len(set(profile.value)) > 1
        ]

    def __call__(self, times: FloatArray) -> FloatArray:
        """Values at times [s], shape (times, n)."""
        found = np.empty((times.size, self._steady.size))
        found[:] = self._steady
        for profile, places in self._moving:
            found[:, places] = profile(times)[:, np.newaxis]
        return found
