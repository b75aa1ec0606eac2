"""Agents that steer tools: scenes as environments with the interface of Gymnasium (gymnasium.farama.org), with or without that package.

    from seldinger.gym import Navigation, Start
    env = Navigation("scenes/exercises/aneurysm.yaml", start=Start(inserted_mm=(0, 5), turned_deg=(-180, 180)))
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Where gymnasium is installed, the environments are ``gymnasium.Env`` and the spaces are gymnasium's; else both are this package's own, which
have the same members. No window and no graphics context is needed.
"""
from .checker import check_environment
from .navigation import Navigation, Start
from .spaces import Box, Dict, has_gymnasium
from .vector import VectorNavigation

__all__ = ["Box", "Dict", "Navigation", "Start", "VectorNavigation", "check_environment", "has_gymnasium"]
