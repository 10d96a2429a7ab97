"""Traction controllers as policies of an environment."""

from __future__ import annotations

from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.rl.environments import TractionEnv, TractionVectorEnv
from contactlib.traction import stacked, structure
from contactlib.traction.interface import Command, Controller, checked_controller


class ControllerPolicy:
    """A traction controller as the policy of an environment, with which others are compared.

    It begins anew with every episode. Unlike a policy on observations it gets the measurement in 64
    bits, so that ``env.hold(policy.torque())`` is a run under the controller to the last bit.

    Parameters
    ----------
    env : TractionEnv or TractionVectorEnv
        The environment; of one that ``gymnasium.make`` made, its ``unwrapped``.
    controller : str, SampledController or TractionController
        Name of a controller that all scenarios have, or an object of your own.

    Raises
    ------
    ValueError
        If a scenario has no such controller, controllers are not of one kind, or their sample time
        is not that of the environment.

    Examples
    --------
    >>> from contactlib.rl import ControllerPolicy, TractionVectorEnv
    >>> env = TractionVectorEnv("dry_wet_dry.toml", 4)
    >>> policy = ControllerPolicy(env, "slope_seeking")
    >>> observation, _ = env.reset(seed=0)
    >>> rewards = []
    >>> while env.time < 10.0:
    ...     observation, reward, *_ = env.step(policy(observation))
    ...     rewards.append(reward.mean())
    >>> f"{sum(rewards) / len(rewards):.2f}"
    '0.95'
    """

    def __init__(self, env: TractionEnv | TractionVectorEnv, controller: str | Controller) -> None:
        controls = [
            one.controller(controller)
            if isinstance(controller, str)
            else checked_controller("controller", controller)
            for one in env.scenarios
            for _ in range(one.axles)
        ]
        if len({structure(one) for one in controls}) > 1:
            raise ValueError(f"controller = {controller!r} must be of one kind in all scenarios")
        times = {one.sample_time for one in controls}
        if times != {env.sample_time}:
            raise ValueError(
                f"sample_time = {env.sample_time!r} of the environment must be the "
                f"controller's, {sorted(times)} s"
            )
        self._env, self._control, self._memory = env, stacked(controls), None

    def torque(self) -> FloatArray:
        """Torques for the environment's present measurement [N.m], once for each sample."""
        demand = self._env.measurement.demand
        measured: Any = self._env.measurement.each(np.ravel)  # controllers take a row of all axles
        if self._env.time == 0.0:
            self._memory = self._control.start(measured, measured.torque)
        answer, self._memory = self._control.sample(measured, self._memory)
        torque, sand = answer if isinstance(answer, Command) else (answer, 0.0)
        if np.any(sand):
            raise ValueError("the controller commands sand: an action is a torque alone")
        return np.asarray(torque, dtype=np.float64).reshape(demand.shape)

    def __call__(self, observation: Any = None) -> FloatArray:
        """Action for the environment's present measurement [1]; the observation is ignored."""
        torque, demand = self.torque(), self._env.measurement.demand
        share = np.divide(torque, demand, out=np.zeros_like(torque), where=demand != 0.0)
        return share.reshape(self._env.action_space.shape)
