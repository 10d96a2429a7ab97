"""Five weights learn traction control on two wet patches; prints mean rewards and their rival's."""

from dataclasses import replace

import numpy as np

import contactlib as cl
from contactlib.rl import ControllerPolicy, TractionVectorEnv

rails, tries = ["dry_wet_dry.toml", "soft_patch.toml"], 24
envs = TractionVectorEnv([replace(cl.load_scenario(r), duration=6.0) for r in rails], 2 * tries)
scales, rng = np.array([envs.scales.torque, *envs.scales]), np.random.default_rng(1)
cut_and_reapply = ControllerPolicy(envs, "threshold")


def mean_reward(seed, weights=None):
    """Mean reward of each wheelset under its weights, or under cut and re-apply."""
    observation, memory, rewards, over = envs.reset(seed=seed)[0], 0.0, [], False
    while not over:
        demand, torque, speed, slip = (observation * scales).T
        share = np.divide(torque, demand, out=np.ones_like(demand), where=demand != 0.0)
        seen = np.clip(np.stack([50.0 * slip / speed, share], axis=-1), -3.0, 3.0)
        memory = memory + [0.3, 0.1] * (seen - memory)
        inputs = np.column_stack([np.ones_like(share), seen, seen - memory])
        change = 0.0 if weights is None else np.tanh((weights * inputs).sum(axis=-1))
        action = np.clip(share + 0.2 * change, 0.0, 1.0)[:, np.newaxis]
        action = cut_and_reapply(observation) if weights is None else action
        observation, reward, _, truncated, _ = envs.step(action)
        rewards, over = [*rewards, reward], truncated.all()
    return np.mean(rewards, axis=0)


mean, spread = np.array([1.0, -1.0, 0.0, 0.0, 0.0]), np.array([3.0, 3.0, 3.0, 3.0, 15.0])
print(f"cut and re-apply: {mean_reward(10_000).mean():.3f}")
for generation in range(8):
    tried = mean + spread * rng.standard_normal((tries, 5))
    reward = mean_reward(100 * generation, np.repeat(tried, 2, axis=0)).reshape(tries, 2).mean(1)
    best = tried[np.argsort(reward)[-5:]]
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.05
print(f"learned: {mean_reward(10_000, mean).mean():.3f}")
