"""Agents that steer tools: scenes as environments with the interface of Gymnasium (gymnasium.farama.org), with or without that package.

    from seldinger import scene_path
    from seldinger.gym import Navigation, Start
    env = Navigation(scene_path("exercises/aneurysm.yaml"), start=Start(inserted_mm=(0, 5), turned_deg=(-180, 180)))
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Where gymnasium is installed, the environments are ``gymnasium.Env`` and the spaces are gymnasium's; else both are this package's own, which
have the same members. The environments are then registered too: ``gymnasium.make("seldinger/BasicWireNav-v0")`` after ``import seldinger.gym``.
No window and no graphics context is needed.
"""
from .checker import check_environment, check_vector_environment
from .navigation import Navigation, Start
from .spaces import Box, Dict, has_gymnasium, register
from .steve import arch_variety, basic_wire_nav, dual_device_nav
from .vector import VectorNavigation

#: Environments by the name under which Gymnasium makes them.
ENVIRONMENTS = {"seldinger/Navigation-v0": "Navigation", "seldinger/BasicWireNav-v0": "basic_wire_nav", "seldinger/ArchVariety-v0": "arch_variety",
                "seldinger/DualDeviceNav-v0": "dual_device_nav"}
for _name, _function in ENVIRONMENTS.items():
    register(_name, f"seldinger.gym:{_function}")

__all__ = ["Box", "Dict", "ENVIRONMENTS", "Navigation", "Start", "VectorNavigation", "arch_variety", "basic_wire_nav", "check_environment",
           "check_vector_environment", "dual_device_nav", "has_gymnasium"]
