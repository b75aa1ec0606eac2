"""Many environments as one, stepped on all cores."""
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._library import ArgumentError, StateError
from ..scene import Scene
from .navigation import Navigation, SceneOrDraw
from .spaces import Dict, VectorEnv, autoreset_mode_of, batch

MODES = ("NextStep", "SameStep", "Disabled")


def _stack(values: Sequence[Any], space: Any) -> Any:
    if isinstance(space, Dict):
        return {key: _stack([value[key] for value in values], space[key]) for key in space.spaces}
    return np.stack(values)


class VectorNavigation(VectorEnv):
    """`num_envs` environments (``Navigation``) as one, with the interface of Gymnasium's vector environments.

    Args:
        scene: as of ``Navigation``; the vessel is shared. Or a list of environments, which this one then owns: ``[basic_wire_nav() for _ in range(8)]``.
        num_envs: number of environments of a scene, at least 1.
        threads: that step them; 0: all cores. The result does not depend on it.
        autoreset_mode: when an environment whose episode has ended begins another one. "NextStep": at the next ``step``, which ignores its
            action and gives the reward 0; "SameStep": at once, and ``info`` holds "final_obs" and "final_info"; "Disabled": by
            ``reset(options={"reset_mask": mask})``.
        options: those of ``Navigation``, with a scene.

    Actions, observations, rewards and ends are stacked, the environment first.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, scene: Union[SceneOrDraw, Sequence[Navigation]], num_envs: Optional[int] = None, *, threads: int = 0,
                 autoreset_mode: Any = "NextStep", **options: Any) -> None:
        self.autoreset_mode = str(getattr(autoreset_mode, "value", autoreset_mode))
        if self.autoreset_mode not in MODES:
            raise ArgumentError(f"autoreset_mode is {autoreset_mode!r}; expected {', '.join(MODES)}")
        if isinstance(scene, (list, tuple)):
            if options or num_envs not in (None, len(scene)) or not scene:
                raise ArgumentError("expected a list of at least one environment without num_envs and options, or a scene with them")
            self.envs: tuple[Navigation, ...] = tuple(scene)
        else:
            if num_envs is None or not num_envs >= 1:
                raise ArgumentError(f"num_envs is {num_envs}; expected at least 1")
            shared = scene if isinstance(scene, Scene) or callable(scene) else Scene(scene)     # type: ignore[arg-type]
            self.envs = tuple(Navigation(shared, **options) for _ in range(num_envs))
        self.num_envs: int = len(self.envs)
        self._pool = ThreadPoolExecutor(threads or os.cpu_count())
        self.single_action_space, self.single_observation_space = self.envs[0].action_space, self.envs[0].observation_space
        self.action_space, self.observation_space = (batch(space, self.num_envs) for space in (self.single_action_space, self.single_observation_space))
        self.render_mode = self.envs[0].render_mode
        self.metadata = dict(self.envs[0].metadata, autoreset_mode=autoreset_mode_of(self.autoreset_mode))
        self._has_ended = np.zeros(self.num_envs, bool)
        self._observations: list[Any] = [None] * self.num_envs

    def reset(self, *, seed: Union[None, int, Sequence[Optional[int]]] = None, options: Optional[dict[str, Any]] = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode in each environment.

        Args:
            seed: of the first one, whose followers have the next numbers; or one for each; None: their random numbers go on.
            options: those of ``Navigation.reset``, and "reset_mask": (num_envs,) bool, the environments that begin anew; others go on.
        """
        seeds = [None if seed is None else seed + i for i in range(self.num_envs)] if seed is None or isinstance(seed, (int, np.integer)) else list(seed)
        if len(seeds) != self.num_envs:
            raise ArgumentError(f"there are {len(seeds)} seeds; expected one for each of {self.num_envs} environments")
        given = dict(options or {})
        mask = np.asarray(given.pop("reset_mask", np.ones(self.num_envs, bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ArgumentError(f"reset_mask is {mask!r}; expected ({self.num_envs},) bool with at least one True")
        if not mask.all() and any(one is None for one in self._observations):
            raise StateError("reset_mask leaves out an environment that no episode was begun in; call reset() for all first")
        super().reset(seed=seeds[0])
        chosen = np.flatnonzero(mask)
        infos: list[Mapping[str, Any]] = [{} for _ in range(self.num_envs)]
        for i, (observation, info) in zip(chosen, self._pool.map(lambda i: self.envs[i].reset(seed=seeds[i], options=given), chosen)):
            self._observations[i], infos[i] = observation, info
        self._has_ended[mask] = False
        return _stack(self._observations, self.single_observation_space), _merged(infos)

    def step(self, actions: ArrayLike) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Makes a command in each environment: observations, rewards (num_envs,), terminations (num_envs,), truncations (num_envs,), infos.

        Raises:
            ArgumentError: the actions have another shape.
            StateError: before ``reset``; or an episode has ended and `autoreset_mode` is "Disabled".
        """
        given = np.asarray(actions)
        if given.shape != self.action_space.shape:
            raise ArgumentError(f"the actions have the shape {given.shape}; expected {self.action_space.shape}")
        if self.autoreset_mode == "Disabled" and self._has_ended.any():
            raise StateError(f"the episodes of environments {np.flatnonzero(self._has_ended).tolist()} have ended; reset them with options={{'reset_mask': …}}")
        results = list(self._pool.map(lambda i: self._step_one(i, given[i]), range(self.num_envs)))
        observations, rewards, terminated, truncated, infos = zip(*results)
        self._observations = list(observations)
        terminations, truncations = np.array(terminated, bool), np.array(truncated, bool)
        self._has_ended = (terminations | truncations) & (self.autoreset_mode != "SameStep")
        return _stack(observations, self.single_observation_space), np.array(rewards, np.float64), terminations, truncations, _merged(infos)

    def _step_one(self, i: int, action: NDArray[Any]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        env = self.envs[i]
        if self._has_ended[i]:
            observation, info = env.reset()
            return observation, 0.0, False, False, info
        observation, reward, terminated, truncated, info = env.step(action)
        if self.autoreset_mode == "SameStep" and (terminated or truncated):
            first, begun = env.reset()
            observation, info = first, {**begun, "final_obs": observation, "final_info": info}
        return observation, reward, terminated, truncated, info

    def render(self) -> Optional[tuple[NDArray[np.uint8], ...]]:
        """The pictures of all environments, or None."""
        return tuple(env.render() for env in self.envs) if self.render_mode else None        # type: ignore[misc]

    def close_extras(self, **ignored: Any) -> None:
        """Frees all simulators: what ``close`` does."""
        self._pool.shutdown()
        for env in self.envs:
            env.close()


def _merged(infos: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The infos of all environments by key, as Gymnasium stacks them: arrays, with a mask `_KEY` of the environments that gave it. "final_obs" is an
    array of objects, the observations themselves."""
    merged: dict[str, Any] = {}
    for key in dict.fromkeys(key for info in infos for key in info):
        mask = np.array([key in info for info in infos])
        values = [info.get(key) for info in infos]
        some = values[int(np.argmax(mask))]
        if key == "final_obs":
            array: Any = np.full(len(infos), None, object)
            array[mask] = [value for value, has_it in zip(values, mask) if has_it]
        elif isinstance(some, Mapping):
            array = _merged([value or {} for value in values])
        else:
            array = np.zeros((len(infos), *np.shape(some)), np.asarray(some).dtype)
            array[mask] = [value for value, has_it in zip(values, mask) if has_it]
        merged[key], merged["_" + key] = array, mask
    return merged
