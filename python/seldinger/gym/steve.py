"""The tasks of stEVE_bench (L. Karstensen et al., github.com/lkarstensen/stEVE_bench, MIT; arXiv 2410.01956) as environments: its tools, friction, hands,
limits, rewards and random targets in our vessels (scenes/steve). Figures were read from its sources; no code was taken.

A target is drawn from the centrelines of the branches that the task names, as there: from all their nodes that do not lie in another branch.

    from seldinger.gym import basic_wire_nav
    env = basic_wire_nav("train")
    observation, info = env.reset(seed=1)
"""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._library import ArgumentError
from ..scene import Scene, scene_path
from .navigation import Navigation


class Task(NamedTuple):
    """What stEVE_bench and the training scripts of stEVE_training give for a task."""

    name: str
    scene: str
    branches: tuple[int, ...]      #: that have targets, in the order of the tree's nodes; 0 begins at the root
    commands: dict[str, int]       #: after which an episode ends, in training and in tests


BASIC_WIRE_NAV = Task("BasicWireNav", "steve/basic-wire-nav.yaml", (1, 2, 3, 4), {"train": 150, "test": 450})
ARCH_VARIETY = Task("ArchVariety", "steve/arch-variety.yaml", (1, 2, 3, 4), {"train": 150, "test": 450})
#: left vertebral, left and right carotid, right vertebral artery
DUAL_DEVICE_NAV = Task("DualDeviceNav", "steve/dual-device-nav.yaml", (3, 4, 7, 9), {"train": 500, "test": 1000})


def branch_of(nodes: NDArray[np.void]) -> NDArray[np.int64]:
    """The branch of each node, (n,): a branch's nodes follow one another, and the next one begins where a node's parent is not the node before."""
    starts = nodes["parent"] != np.arange(len(nodes)) - 1
    return np.cumsum(starts)


def possible_targets(scene: Scene, branches: tuple[int, ...]) -> NDArray[np.float64]:
    """The centres, (m, 3) mm, of all nodes of some branches that lie in none of the other branches: nearer to a node of those than its radius."""
    nodes = scene.nodes
    is_chosen = np.isin(branch_of(nodes), branches)
    own, other = nodes["center_mm"][is_chosen], nodes[~is_chosen]
    way = np.linalg.norm(own[:, None] - other["center_mm"][None], axis=2)
    return own[np.all(way >= other["radius_mm"], axis=1)]


def with_target(scene: Scene, point: NDArray[np.float64]) -> Scene:
    """The scene with its target at a point, (3,) mm."""
    return scene.with_values({"targets.0.name": "target", "targets.0.point_mm": point, "exercise.target": "target",
                              "exercise.instructions": "Bring the tip of the wire to the target."})


def _environment(task: Task, mode: str, draw: Any, options: dict[str, Any]) -> Navigation:
    if mode not in task.commands:
        raise ArgumentError(f"mode is {mode!r}; expected {' or '.join(task.commands)}")
    return Navigation(draw, **{"reward": "steve", "command_s": 1 / 7.5, "push_mm_s": 35.0, "twist_deg_s": 180.0, "commands": task.commands[mode],
                               "vessel_ends": mode == "train",
                               "observe": ("tip", "shaft", "target"), **options})


def _in_one_vessel(task: Task, mode: str, options: dict[str, Any]) -> Navigation:
    scene = Scene(scene_path(task.scene))
    targets = possible_targets(scene, task.branches)
    return _environment(task, mode, lambda random: with_target(scene, random.choice(targets)), options)


def basic_wire_nav(mode: str = "train", **options: Any) -> Navigation:
    """BasicWireNav: a J-tipped wire from the descending aorta to a point of a branch of the arch.

    Args:
        mode: "train": an episode has at most 150 commands and ends where the tip reaches a vessel's end; "test": 450.
        options: of ``Navigation``, instead of stEVE_bench's.
    """
    return _in_one_vessel(BASIC_WIRE_NAV, mode, options)


def dual_device_nav(mode: str = "train", **options: Any) -> Navigation:
    """DualDeviceNav: a wire in a microcatheter from the iliac artery to a point of a carotid or vertebral artery.

    Args:
        mode: "train": an episode has at most 500 commands and ends where the tip reaches a vessel's end; "test": 1,000.
        options: of ``Navigation``, instead of stEVE_bench's.
    """
    return _in_one_vessel(DUAL_DEVICE_NAV, mode, options)


def arch_variety(mode: str = "train", arches: int = 50, **options: Any) -> Navigation:
    """ArchVariety: the wire of BasicWireNav in another arch of type I in each episode, with a point of one of its branches.

    Args:
        mode: "train": an episode has at most 150 commands and ends where the tip reaches a vessel's end; "test": 450.
        arches: number of different arches, those of the seeds 1 to `arches`. An arch is fitted at its first use, in 3 s of processor time, then it is
            in the user's cache.
        options: of ``Navigation``, instead of stEVE_bench's.
    """
    if not arches >= 1:
        raise ArgumentError(f"arches is {arches}; expected at least 1")
    scene = Scene(scene_path(ARCH_VARIETY.scene))

    def draw(random: np.random.Generator) -> Scene:
        other = scene.with_values({"vessel.shape.seed": int(random.integers(1, arches + 1))})
        return with_target(other, random.choice(possible_targets(other, ARCH_VARIETY.branches)))
    return _environment(ARCH_VARIETY, mode, draw, options)
