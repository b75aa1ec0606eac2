"""Checks an environment against Gymnasium's documented contract (gymnasium.farama.org/api/env, version 1.0), without that package."""
from __future__ import annotations

import inspect
from typing import Any

import numpy as np


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    return np.asarray(a).dtype == np.asarray(b).dtype and np.array_equal(a, b)


def _copied(a: Any) -> Any:
    return {key: np.copy(value) for key, value in a.items()} if isinstance(a, dict) else np.copy(a)


def check_environment(env: Any, *, commands: int = 20, seed: int = 123) -> None:
    """Raises AssertionError with the first rule of the contract that `env` breaks.

    Args:
        env: an environment that is not used otherwise; it is reset and stepped, not closed.
        commands: how many steps are tried.
        seed: of the episodes and actions.
    """
    for name in ("action_space", "observation_space", "metadata", "render_mode", "np_random", "unwrapped", "spec", "reset", "step", "render", "close"):
        assert hasattr(env, name), f"there is no member {name}"
    for name in ("sample", "contains", "seed", "shape", "dtype"):
        for space in ("action_space", "observation_space"):
            assert hasattr(getattr(env, space), name), f"{space} has no member {name}"
    modes = env.metadata.get("render_modes")
    assert isinstance(modes, list), "metadata['render_modes'] is no list"
    assert env.render_mode is None or env.render_mode in modes, f"render_mode is {env.render_mode!r}, which metadata['render_modes'] {modes} does not hold"
    parameters = inspect.signature(env.reset).parameters
    for name in ("seed", "options"):
        assert name in parameters and parameters[name].kind is not inspect.Parameter.POSITIONAL_ONLY, f"reset() takes no keyword {name}"
        assert parameters[name].default is None, f"reset()'s {name} has the default {parameters[name].default!r} instead of None"

    def begun(**given: Any) -> Any:
        result = env.reset(**given)
        assert isinstance(result, tuple) and len(result) == 2, "reset() does not return (observation, info)"
        observation, info = result
        assert env.observation_space.contains(observation), "the first observation is not in observation_space"
        assert isinstance(info, dict), "reset()'s info is no dictionary"
        return observation

    def episode() -> list[Any]:
        """Observations, rewards and ends of an episode with the actions of a seed."""
        given = [begun(seed=seed)]
        path: list[Any] = [_copied(given[0])]
        env.action_space.seed(seed)
        for _ in range(commands):
            action = env.action_space.sample()
            assert env.action_space.contains(action), "a sample of action_space is not in it"
            kept = np.copy(action)
            result = env.step(action)
            assert np.array_equal(kept, action), "step() changes the action"
            assert isinstance(result, tuple) and len(result) == 5, "step() does not return (observation, reward, terminated, truncated, info)"
            observation, reward, terminated, truncated, info = result
            assert env.observation_space.contains(observation), "an observation is not in observation_space"
            assert isinstance(reward, (float, int, np.floating, np.integer)) and np.isfinite(reward), f"the reward is {reward!r}, no finite number"
            assert isinstance(terminated, (bool, np.bool_)) and isinstance(truncated, (bool, np.bool_)), "terminated or truncated is no bool"
            assert isinstance(info, dict), "step()'s info is no dictionary"
            given.append(observation)
            path.append((_copied(observation), reward, terminated, truncated))
            if terminated or truncated:
                break
        assert all(_same(a, b if i == 0 else b[0]) for i, (a, b) in enumerate(zip(given, path))), "step() overwrites an earlier observation"
        return path

    one, two = episode(), episode()
    assert len(one) == len(two), "two episodes of one seed and the same actions have different lengths"
    for i, (a, b) in enumerate(zip(one, two)):
        same = _same(a, b) if i == 0 else _same(a[0], b[0]) and a[1:] == b[1:]
        assert same, f"two episodes of one seed and the same actions differ after {i} steps"
    # the random numbers belong to the environment: they go on without a seed, and begin anew with one
    begun(seed=seed)
    state = env.np_random.bit_generator.state
    begun(seed=seed)
    assert env.np_random.bit_generator.state == state, "the same seed leaves np_random in different states"
    begun()
    begun(options={})
    picture = env.render()
    if env.render_mode == "rgb_array":
        assert isinstance(picture, np.ndarray) and picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3, \
            "render() gives no (height, width, 3) array of uint8"
