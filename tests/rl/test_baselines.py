"""Controllers as policies: the run of the scenario, in the loop of an environment."""

from __future__ import annotations

import numpy as np
import pytest
from own_controller import SlipPI
from plain_scenario import of_axles, wet_patch

import contactlib as cl
from contactlib.vehicle import DynamicLoad

pytest.importorskip("gymnasium")
rl = pytest.importorskip("contactlib.rl")
FINE = {"tolerance": 1e-7, "step": 5e-3}  # of run_scenario


@pytest.mark.slow
def test_a_controller_in_the_loop_gives_its_run_to_the_last_bit() -> None:
    load, name = DynamicLoad(frequency=(0.5, 9.0), density=(0.02, 0.0)), "slope_seeking"
    scenario = wet_patch(duration=4.0, dynamic_load=load)
    envs = rl.TractionVectorEnv(scenario, 2, **FINE)
    policy = rl.ControllerPolicy(envs, name)
    runs = [cl.run_scenario(scenario, name, index=i) for i in (2, 3)]
    for steps in (50, 400):  # it begins anew with the episode
        envs.reset(seed=2)
        for i in range(steps):
            *_, infos = envs.hold(policy.torque())
            for k, run in enumerate(runs):
                for signal in ("creepage", "speed", "creep_force"):
                    assert infos[signal][k] == run[signal][2 * i + 2]
    assert infos["commanded_torque"].max() < 0.9 * max(scenario.demand.value)  # it limits


@pytest.mark.parametrize("axles", [1, 2, 4])
def test_a_vehicle_in_the_loop_gives_its_run_to_the_last_bit(axles: int) -> None:
    """Alone under the torques of the run, and in the vector form under the controller."""
    scenario = of_axles(axles, duration=0.4, demand=cl.Profile((0.0, 0.3), (1e4, 3e4)))
    run = cl.run_scenario(scenario, "creep_pi", index=2, tolerance=1e-5)
    settings = {"tolerance": 1e-5, "step": 5e-3}
    env, envs = rl.TractionEnv(scenario, **settings), rl.TractionVectorEnv(scenario, 2, **settings)
    assert env.action_space.shape == (axles,)
    assert env.observation_space.shape == ((4,) if axles == 1 else (axles, 4))
    policy = rl.ControllerPolicy(envs, "creep_pi")
    (observed, _), (several, _) = env.reset(seed=2), envs.reset(seed=2)
    for i in range(30):
        np.testing.assert_array_equal(several[0], observed)
        observed, reward, *_, info = env.hold(run["commanded_torque"][2 * i])
        several, rewards, *_, infos = envs.hold(policy.torque())
        assert rewards[0] == reward <= 1.0
        for name, value in info.items():
            row = 2 * i + 2 * (name != "commanded_torque")  # which was held
            np.testing.assert_array_equal(value, run[name][row])
            np.testing.assert_array_equal(infos[name][0], value)
    assert observed in env.observation_space
    assert several in envs.observation_space
    shares = np.full((2, axles), 0.5)
    demand = envs.measurement.demand
    envs.step(shares)
    np.testing.assert_array_equal(envs.measurement.torque, 0.5 * demand)


def test_actions_of_a_controller_are_its_torques_but_for_rounding() -> None:
    scenario = wet_patch(duration=4.0)
    env = rl.TractionEnv(scenario)
    for controller in (SlipPI(), "threshold"):
        run = cl.run_scenario(scenario, controller, index=1, step=0.01, tolerance=1e-4)
        policy = rl.ControllerPolicy(env, controller)
        observed, info = env.reset(seed=1)
        while env.time < 3.995:
            observed, *_, info = env.step(policy(observed))
        assert info["creepage"] == pytest.approx(run["creepage"][-1], rel=1e-6)


def test_a_controller_that_does_not_fit_is_refused() -> None:
    env = rl.TractionEnv(wet_patch(), sample_time=0.005)
    with pytest.raises(ValueError, match=r"sample_time = 0\.005 of the environment must be the"):
        rl.ControllerPolicy(env, "threshold")
    with pytest.raises(ValueError, match="'nothing'"):
        rl.ControllerPolicy(env, "nothing")
    other = wet_patch()
    mixed = [wet_patch(controllers={"x": other.controller(n)}) for n in ("threshold", "creep_pi")]
    with pytest.raises(ValueError, match="'x' must be of one kind in all scenarios"):
        rl.ControllerPolicy(rl.TractionVectorEnv(mixed, 2), "x")
    assert np.all(env.reset(seed=0)[0][:2] == 0.0)
