"""Gymnasium environments of traction control; a program imports this package by its name."""

from contactlib.rl.baselines import ControllerPolicy
from contactlib.rl.environments import Scales, TractionEnv, TractionVectorEnv

__all__ = ["ControllerPolicy", "Scales", "TractionEnv", "TractionVectorEnv"]
