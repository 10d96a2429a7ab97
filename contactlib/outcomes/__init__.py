"""What is told of a run by one number, summed up block by block of its rows.

Of many runs no more is kept than these sums. Time integrals are trapezoidal over the rows; a row's
demand holds until the next row. Q is the creep force of both wheels, s the direction that the
demand asks for, and

    Q_d = (T_d - b V/r + F J/(M r))/(r + J/(M r))     (held speed: (T_d - b V/r - V' J/r)/r)
    Q_t = min(Q_max, |Q_d|)

Q_d is the force that the demanded torque T_d would give if the wheelset rolled against the
resistance F: what is left after the drive's damping b and after what turns the wheelset along with
the vehicle. Q_max is the largest force that friction allows there and then, at one creepage of both
wheels; so Q_t is what can be transmitted.
"""

from contactlib.outcomes.registry import OUTCOMES, Outcome, observers
from contactlib.outcomes.rows import Rows, Seen, Vehicles

__all__ = ["OUTCOMES", "Outcome", "Rows", "Seen", "Vehicles", "observers"]
