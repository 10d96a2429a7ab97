"""The plant as Gymnasium environments: their contract, their bits, and what the reward counts."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from plain_scenario import wet_patch

import contactlib as cl
from contactlib.runs.accumulators import DerivedRows, DrivetrainArrays

gymnasium = pytest.importorskip("gymnasium")
rl = pytest.importorskip("contactlib.rl")


def pickled(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))  # noqa: S301 - of our own making


@pytest.fixture(scope="module")
def patch() -> cl.Scenario:
    """The wet patch, left after 6 s."""
    return wet_patch(duration=6.0)


def test_gymnasium_s_own_checks_pass() -> None:
    from gymnasium.utils.env_checker import check_env

    for name in ("dry_wet_dry.toml", "four_axles.toml"):
        unchecked = {"scenario": name, "disable_env_checker": True}
        check_env(gymnasium.make("contactlib/Traction-v1", **unchecked).unwrapped)
    braking = gymnasium.make("contactlib/Traction-v1", scenario="braking.toml")  # with its checker
    braking.reset(seed=1)
    for _ in range(300):
        observation, _, _, truncated, _ = braking.step(braking.action_space.sample())
        assert not truncated
    assert observation[0] < 0.0  # demand


def test_the_vector_form_keeps_its_contract(patch: cl.Scenario) -> None:
    made = gymnasium.make_vec(
        "contactlib/Traction-v1",
        num_envs=3,
        vectorization_mode="vector_entry_point",
        scenario=replace(patch, duration=0.05),
    )
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(made)
    assert envs.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
    first, _ = envs.reset(seed=5)
    seen = []
    for _ in range(13):
        observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
        assert observations in envs.observation_space
        assert [x.shape for x in (rewards, terminated, truncated)] == [(3,)] * 3
        assert all(value.shape[0] == 3 for value in infos.values() if not isinstance(value, dict))
        assert not terminated.any()
        seen.append((bool(truncated.all()), float(rewards.sum())))
        if truncated.all():
            assert infos["episode"]["l"].tolist() == [5, 5, 5]
    assert [i for i, (over, _) in enumerate(seen) if over] == [4, 10]
    assert [i for i, (_, reward) in enumerate(seen) if reward == 0.0] == [5, 11]  # are reset
    np.testing.assert_array_equal(envs.reset(seed=5)[0], first)
    # All share one clock: a mask that leaves one out is refused, and nothing is reset.
    envs.step(envs.action_space.sample())
    for mask in (np.array([True, False, True]), np.zeros(3, dtype=bool)):
        with pytest.raises(ValueError, match=r"reset_mask.*False.* leaves one out"):
            made.reset(seed=5, options={"reset_mask": mask})
        assert made.time > 0.0
    made.reset(seed=5, options={"reset_mask": np.ones(3, dtype=bool)})
    assert made.time == 0.0


def test_wheelsets_of_the_vector_form_are_single_ones_to_the_last_bit(patch: cl.Scenario) -> None:
    wet = [replace(patch, demand=cl.Profile.of(torque)) for torque in (1e4, 2e4)]
    settings = {"scales": rl.Scales(2e4), "slip_cost": 2.0}
    together, singles = rl.TractionVectorEnv(wet, 3, **settings), []
    observed, _ = together.reset(seed=7)
    for i in range(3):
        singles.append(rl.TractionEnv(wet[i % 2], **settings))
        np.testing.assert_array_equal(singles[i].reset(seed=7 + i)[0], observed[i])
    for actions in np.random.default_rng(1).uniform(size=(50, 3, 1)):
        observed, rewards, _, _, infos = together.step(actions)
        for i, env in enumerate(singles):
            mine, reward, _, _, info = env.step(actions[i])
            np.testing.assert_array_equal(mine, observed[i])
            assert reward == rewards[i]
            assert info == {name: value[i] for name, value in infos.items()}


def test_an_observation_is_the_measurement_over_its_scales(patch: cl.Scenario) -> None:
    noisy = replace(patch, sensors=replace(patch.sensors, wheel_speed_noise=1.0))
    env = rl.TractionEnv(noisy)
    assert env.scales == (24.5e3, 10.0, 0.1)
    env.reset(seed=1)
    for action in np.linspace(0.0, 1.0, 300):
        observed, *_ = env.step([action])
        seen = env.measurement
        slip = seen.wheel_speed - seen.vehicle_speed
        expected = seen.demand / 24.5e3, seen.torque / 24.5e3, seen.vehicle_speed / 10.0, slip / 0.1
        np.testing.assert_allclose(observed, np.ravel(expected), rtol=1e-6)
        assert observed in env.observation_space


def test_the_reward_counts_what_the_metrics_count(patch: cl.Scenario) -> None:
    used, allowed, work = 0.0, 0.0, 0.0
    without, env = (rl.TractionEnv(patch, slip_cost=cost) for cost in (0.0, 1.0))
    policy = rl.ControllerPolicy(env, "slope_seeking")
    without.reset(seed=4)
    reward, truncated, (_, info) = 0.0, False, env.reset(seed=4)
    while not truncated:
        rows = DerivedRows(env.plant.now(), DrivetrainArrays.of([patch.drivetrain]))
        limited = rows.limited[0, 0] and env.time > 0.0
        torque, before = policy.torque(), env.time
        if limited:
            used, allowed = (
                used + reward * info["available_force"],
                allowed + info["available_force"],
            )
        _, reward, *_ = without.hold(torque)
        _, whole, _, truncated, info = env.hold(torque)
        work += (reward - whole) * info["available_force"] * info["speed"] * (env.time - before)
    outcomes = cl.run_many(
        [patch], "slope_seeking", ["limited_utilisation", "slip_work"], index=[4]
    )
    assert used / allowed == pytest.approx(outcomes["limited_utilisation"][0], rel=1e-9)
    assert work == pytest.approx(outcomes["slip_work"][0], rel=1e-9)


@pytest.mark.parametrize("way", [copy.deepcopy, copy.copy, pickled])
def test_copies_of_an_environment_go_on_with_its_bits_on_their_own(
    patch: cl.Scenario, way: Callable[[Any], Any]
) -> None:
    forms = [rl.TractionEnv(patch), rl.TractionVectorEnv([patch, replace(patch, duration=6.0)], 3)]
    forms += [rl.TractionEnv("four_axles.toml"), rl.TractionVectorEnv("four_axles.toml", 2)]
    for env in forms:
        env.reset(seed=2)
        actions = np.random.default_rng(1).uniform(0.5, 1.0, (60, *env.action_space.shape))
        for action in actions:
            env.step(action)
        other = way(env)
        expected = [env.step(action) for action in actions]
        steps = [other.step(action) for action in actions]
        np.testing.assert_equal(steps, expected)
        np.testing.assert_equal(other.reset(), env.reset())  # and its random numbers


def test_a_policy_plans_on_a_copy_of_its_environment(patch: cl.Scenario) -> None:
    env = rl.TractionEnv(patch)
    policy = rl.ControllerPolicy(env, "threshold")
    env.reset(seed=1)
    for _ in range(40):
        env.step(policy())
    planned, copied = copy.deepcopy((env, policy))
    ahead = [planned.step(copied())[1] for _ in range(80)]
    assert env.time == pytest.approx(0.4)
    assert [env.step(policy())[1] for _ in range(80)] == ahead


def test_a_step_needs_a_reset(patch: cl.Scenario) -> None:
    env, envs = rl.TractionEnv(patch), rl.TractionVectorEnv(patch, 2)
    for call in (
        lambda: env.step([1.0]),
        lambda: env.hold(1e3),
        lambda: envs.step([[1.0], [1.0]]),
        lambda: envs.hold(1e3),
        lambda: env.measurement,
        rl.ControllerPolicy(env, "threshold"),
    ):
        with pytest.raises(gymnasium.error.ResetNeeded, match="call reset first"):
            call()


def test_where_an_integrator_gives_up_all_episodes_end(patch: cl.Scenario) -> None:
    envs = rl.TractionVectorEnv(patch, 3)
    envs.reset(seed=1)
    envs.plant.failed[1] = True
    _, rewards, terminated, truncated, _ = envs.step(np.ones((3, 1)))
    assert terminated.tolist() == [False, True, False]
    assert truncated.tolist() == [True, False, True]
    assert rewards[1] == 0.0
    envs.step(np.ones((3, 1)))
    assert envs.time == 0.0
    assert not envs.plant.failed.any()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"scenario": []}, r"scenario = \[\] is too short"),
        ({"num_envs": 0}, r"num_envs = 0\.0 is out of range"),
        ({"slip_cost": -1.0}, r"slip_cost = -1\.0 is out of range"),
        ({"scales": (0.0, 1.0, 1.0)}, r"scales\.torque = 0\.0 is out of range"),
        ({"step": -1.0}, r"step = -1\.0 is out of range"),
    ],
)
def test_arguments_are_checked(patch: cl.Scenario, given: dict[str, Any], message: str) -> None:
    if "scales" in given:
        given = {"scales": rl.Scales(*given["scales"])}
    with pytest.raises(ValueError, match=message):
        rl.TractionVectorEnv(**{"scenario": patch, "num_envs": 2, **given})


def test_scenarios_that_do_not_fit_together_are_refused(patch: cl.Scenario) -> None:
    longer = replace(patch, duration=7.0)
    with pytest.raises(ValueError, match=r"durations of \[6\.0, 7\.0\] s: they must be equal"):
        rl.TractionVectorEnv([patch, longer], 2)
    envs = rl.TractionVectorEnv(patch, 2)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="action has the shape"):
        envs.step([0.5])
    with pytest.raises(ValueError, match="torque"):
        envs.step([[np.nan], [0.0]])


def test_an_episode_off_its_map_is_warned_of_once() -> None:
    rails = cl.Track.from_breakpoints(distance=(0.0, 1.0), friction=(1.0, 0.8), map="m.csv")
    case = replace(cl.load_scenario("dry_wet_dry.toml"), track=rails, duration=0.2)
    environment = rl.TractionEnv(case)
    for episode in range(2):
        environment.reset(seed=episode)
        for _ in range(19):
            environment.step(np.ones(1))
        warned = pytest.warns(cl.InputWarning, match="leaves the map m.csv")
        with warned if episode == 0 else nullcontext():
            environment.step(np.ones(1))
