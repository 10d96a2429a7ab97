"""How long a drive takes to get back what friction lets it have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contactlib.outcomes.rows import Seen, Vehicles
from contactlib.outcomes.sums import Joint
from contactlib.parameters import FloatArray

RECOVERED = 0.9  # part of what can be transmitted that counts as all of it [1]
STAYS = 1.0  # after this time without a lack it is a new one [s]
JUMP = 0.05  # of nominal friction or grip: what changes by more from row to row jumps [1]
NEGLIGIBLE = 0.01  # part of the grip that does not count [1]


class Recovery:
    """After a change of friction or demand, the longest time until the force is back [s].

    It lasts from the first moment at which s Q lacks more than a tenth of Q_t, and than a hundredth
    of the grip, until it has come back for a second at least. The grip is kinetic friction times
    the nominal load. A change is where a signal begins to move, or jumps: a factor of friction by
    more than 0.05, the demand by more than a twentieth of what the grip takes. Who still lacks it
    at the next change is waited for on. Infinite if the run ends so; nan if nothing changes.
    """

    def __init__(self, vehicles: Vehicles) -> None:
        n = vehicles.grip.size
        torque = vehicles.radius * vehicles.grip
        self._negligible = NEGLIGIBLE * vehicles.grip
        self._jumps = {
            "friction_scale_left": np.full(n, JUMP),
            "friction_scale_right": np.full(n, JUMP),
            "demand": JUMP * torque,
        }
        self._moved = {name: np.zeros(n, dtype=np.bool_) for name in self._jumps}
        self._joint = Joint()
        self._changes = np.zeros(n, dtype=np.bool_)  # the last row
        self._changed = np.zeros(n, dtype=np.bool_)  # any row so far
        self._over = np.ones(n, dtype=np.bool_)  # answered, until the next change
        self._since = np.full(n, np.nan)  # first lack that is not answered
        self._back = np.full(n, np.nan)  # first row after the last lack
        self._last = np.full(n, np.nan)  # last lack
        self._longest = np.zeros(n)
        self._end = 0.0, np.zeros(n, dtype=np.bool_)  # time and lack of the last row

    def see(self, rows: Seen) -> None:
        """Take in the next rows."""
        force, wanted = rows.transmittable
        lack = np.maximum((1.0 - RECOVERED) * wanted, self._negligible)
        lacking = (wanted - force > lack) & (rows["demand"] != 0.0)
        signals = [rows[name] for name in self._jumps]
        time, lacking, *signals = self._joint(rows.time, lacking, *signals)
        changes = np.zeros(lacking.shape, dtype=np.bool_)
        changes[0] = self._changes
        for (name, jump), signal in zip(self._jumps.items(), signals, strict=True):
            step = np.abs(np.diff(signal, axis=0))
            moves = np.concatenate([self._moved[name][np.newaxis], step != 0.0])
            changes[1:] |= (moves[1:] & ~moves[:-1]) | (step > jump)
            self._moved[name] = moves[-1]
        # The last row waits: nobody can answer to the last one of a run.
        for i, t in enumerate(time[:-1].tolist()):
            self._row(t, changes[i], lacking[i])
        self._changes, self._end = changes[-1], (float(time[-1]), lacking[-1])

    def value(self) -> FloatArray:
        """Of the rows so far."""
        time, lacking = self._end
        self._row(time, np.zeros_like(lacking), lacking)
        waits = ~np.isnan(self._since)
        last = np.where(np.isnan(self._back), np.inf, self._back - self._since)
        longest = np.where(waits, np.maximum(self._longest, last), self._longest)
        return np.where(self._changed, longest, np.nan)

    def _row(self, time: float, changes: NDArray[np.bool_], lacking: NDArray[np.bool_]) -> None:
        waits = ~np.isnan(self._since)
        if not (waits.any() or changes.any() or (lacking & ~self._over).any()):
            return
        back = ~np.isnan(self._back)
        stays = waits & back & (time - self._last > STAYS)
        answered = waits & back & (changes | stays)
        took = np.where(answered, self._back - self._since, 0.0)
        self._longest = np.maximum(self._longest, took)
        self._since[answered] = self._back[answered] = np.nan
        self._over = (self._over | stays) & ~changes
        self._changed |= changes

        lacks = lacking & ~self._over
        self._since = np.where(lacks & np.isnan(self._since), time, self._since)
        self._last = np.where(lacks, time, self._last)
        self._back[lacks] = np.nan
        comes = ~lacking & ~np.isnan(self._since) & np.isnan(self._back)
        self._back = np.where(comes, time, self._back)
