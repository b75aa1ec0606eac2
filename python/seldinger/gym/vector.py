"""Many environments of one scene, stepped together on all cores."""
from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._library import ArgumentError, PathLike
from ..batch import Batch
from ..scene import Scene
from .navigation import Navigation
from .spaces import Dict, VectorEnv, batch


def _stack(values: Sequence[Any], space: Any) -> Any:
    if isinstance(space, Dict):
        return {key: _stack([value[key] for value in values], space[key]) for key in space.spaces}
    return np.stack(values)


class VectorNavigation(VectorEnv):
    """`num_envs` environments (``Navigation``) of one scene as one, with the interface of Gymnasium's vector environments.

    Args:
        scene: as of ``Navigation``; the vessel is shared.
        num_envs: number of environments, at least 1.
        threads: that make the steps (``Batch``); 0: all cores. The result does not depend on it.
        options: those of ``Navigation``.

    Actions, observations, rewards and ends are stacked, the environment first. An environment whose episode has ended begins another one at
    the next ``step``, which ignores its action and gives the reward 0 (Gymnasium's ``AutoresetMode.NEXT_STEP``).
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, scene: Union[Scene, PathLike, Mapping[str, Any]], num_envs: int, *, threads: int = 0, **options: Any) -> None:
        if not num_envs >= 1:
            raise ArgumentError(f"num_envs is {num_envs}; expected at least 1")
        shared = scene if isinstance(scene, Scene) else Scene(scene)
        self._batch = Batch(shared, num_envs, threads=threads)
        self.envs = tuple(Navigation(shared, simulator=self._batch.simulator(i), **options) for i in range(num_envs))
        self.num_envs: int = num_envs
        self.single_action_space, self.single_observation_space = self.envs[0].action_space, self.envs[0].observation_space
        self.action_space, self.observation_space = (batch(space, num_envs) for space in (self.single_action_space, self.single_observation_space))
        self.render_mode = self.envs[0].render_mode
        self.metadata = dict(self.metadata, autoreset_mode=_next_step())
        self._has_ended = np.zeros(num_envs, bool)

    def reset(self, *, seed: Union[None, int, Sequence[Optional[int]]] = None, options: Optional[dict[str, Any]] = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode in each environment. `seed`: of the first one, whose followers have the next numbers; or one for each."""
        seeds = [None if seed is None else seed + i for i in range(self.num_envs)] if seed is None or isinstance(seed, (int, np.integer)) else list(seed)
        if len(seeds) != self.num_envs:
            raise ArgumentError(f"there are {len(seeds)} seeds; expected one for each of {self.num_envs} environments")
        results = [env.reset(seed=one, options=options) for env, one in zip(self.envs, seeds)]
        self._has_ended[:] = False
        return _stack([one[0] for one in results], self.single_observation_space), _merged([one[1] for one in results])

    def step(self, actions: ArrayLike) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Makes a command in each environment: observations, rewards (num_envs,), terminations (num_envs,), truncations (num_envs,), infos."""
        given = np.asarray(actions)
        if given.shape != self.action_space.shape:
            raise ArgumentError(f"the actions have the shape {given.shape}; expected {self.action_space.shape}")
        commands = np.zeros(self.action_space.shape)
        for i in np.flatnonzero(~self._has_ended):
            commands[i] = self.envs[i].command_of(given[i])
        self._batch.step(commands, n=self.envs[0].steps_per_command, skip=self._has_ended)
        results = [_begun(env.reset()) if has_ended else env.judge() for env, has_ended in zip(self.envs, self._has_ended)]
        observations, rewards, terminated, truncated, infos = zip(*results)
        terminations, truncations = np.array(terminated, bool), np.array(truncated, bool)
        self._has_ended = terminations | truncations
        return _stack(observations, self.single_observation_space), np.array(rewards, np.float64), terminations, truncations, _merged(infos)

    def render(self) -> Optional[tuple[NDArray[np.uint8], ...]]:
        """The pictures of all environments, or None."""
        return tuple(env.render() for env in self.envs) if self.render_mode else None

    def close(self, **ignored: Any) -> None:
        """Frees all simulators."""
        for env in self.envs:
            env.close()
        self._batch.close()


def _begun(result: Any) -> tuple[Any, float, bool, bool, Any]:
    observation, info = result
    return observation, 0.0, False, False, info


def _next_step() -> Any:
    """Gymnasium's name of when ended environments begin anew; its text where there is no such name."""
    try:
        from gymnasium.vector import AutoresetMode
    except ImportError:
        return "NextStep"
    return AutoresetMode.NEXT_STEP


def _merged(infos: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The infos of all environments by key, as Gymnasium stacks them: arrays, with a mask `_KEY` of the environments that gave it."""
    merged: dict[str, Any] = {}
    for key in infos[0]:
        values = [info[key] for info in infos]
        merged[key] = _merged(values) if isinstance(values[0], Mapping) else np.array(values)
        merged["_" + key] = np.ones(len(infos), bool)
    return merged
