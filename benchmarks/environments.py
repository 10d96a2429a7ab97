"""Speed of the vector environment on one core: ``python benchmarks/environments.py [N]``.

N wheelsets, 10 000 by default, cross the wet patch of dry_wet_dry.toml for 10 s in steps of 10 ms.
Wheelset-steps are wheelsets times calls of `step`, and time is processor time, of `step` alone.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from timing import one_core

from contactlib.rl import ControllerPolicy, TractionVectorEnv

UNTIL = 10.0  # [s]


def rate(envs: TractionVectorEnv, controller: str | None) -> float:
    """Wheelset-steps per second: under a controller, or at 60 % of the demand."""
    policy = None if controller is None else ControllerPolicy(envs, controller)
    actions = np.full((envs.num_envs, 1), 0.6)
    observations, _ = envs.reset(seed=0)
    steps, spent = 0, 0.0
    while envs.time < UNTIL:
        if policy is not None:
            actions = policy(observations)
        before = time.process_time()
        observations, *_ = envs.step(actions)
        spent += time.process_time() - before
        steps += envs.num_envs
    return steps / spent


if __name__ == "__main__":
    with one_core():
        many = TractionVectorEnv("dry_wet_dry.toml", int(sys.argv[1]) if sys.argv[1:] else 10_000)
        for name in (None, "threshold", "creep_pi", "slope_seeking"):
            print(f"{name or '60 % of the demand'}: {rate(many, name):,.0f} wheelset-steps per s")
