"""Checks an environment against Gymnasium's contract (gymnasium.farama.org/api/env and /api/vector, versions 1.0 and 1.1), without that package.

The rules are those of the documentation and those that gymnasium.utils.env_checker and passive_env_checker test or warn of; a few of ours are stricter:
ends are bool and rewards float, observations are contiguous, no step changes an action or an earlier observation, the same seed gives the same bits.
"""
from __future__ import annotations

import inspect
from numbers import Real
from typing import Any

import numpy as np

from .spaces import Dict


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    return np.asarray(a).dtype == np.asarray(b).dtype and np.array_equal(a, b)


def _copied(a: Any) -> Any:
    return {key: np.copy(value) for key, value in a.items()} if isinstance(a, dict) else np.copy(a)


def _check_space(space: Any, name: str) -> None:
    for member in ("sample", "contains", "seed", "shape", "dtype", "np_random", "__contains__"):
        assert hasattr(space, member), f"{name} has no member {member}"
    if isinstance(space, Dict):
        assert len(space.spaces) > 0, f"{name} has no key"
        for key, part in space.spaces.items():
            _check_space(part, f"{name}[{key!r}]")
    else:
        for bound in ("low", "high"):
            assert getattr(space, bound).shape == space.shape, f"{name}.{bound} has the shape {getattr(space, bound).shape} instead of {space.shape}"
            assert np.all(np.isfinite(getattr(space, bound))), f"{name}.{bound} is not finite"
        assert np.all(space.low < space.high), f"{name} has a bound `low` that is not below `high`"
    space.seed(7)
    first = space.sample()
    space.seed(7)
    assert _same(first, space.sample()), f"the same seed gives different samples of {name}"
    assert first in space, f"a sample of {name} is not in it"


def _check_observation(observation: Any, space: Any, where: str) -> None:
    if isinstance(space, Dict):
        assert isinstance(observation, dict), f"{where} is a {type(observation).__name__}; expected a dictionary"
        assert observation.keys() == space.spaces.keys(), f"{where} has the keys {list(observation)}; expected {list(space.spaces)}"
        for key, part in space.spaces.items():
            _check_observation(observation[key], part, f"{where}[{key!r}]")
    else:
        assert isinstance(observation, np.ndarray), f"{where} is a {type(observation).__name__}; expected an array"
        assert observation.dtype == space.dtype, f"{where} has the type {observation.dtype}; expected {space.dtype}"
        assert observation.shape == space.shape, f"{where} has the shape {observation.shape}; expected {space.shape}"
        assert observation.flags.c_contiguous, f"{where} is not contiguous"
    assert observation in space, f"{where} is not in its space"


def _check_render(env: Any) -> None:
    modes = env.metadata.get("render_modes")
    assert isinstance(modes, (list, tuple)) and all(isinstance(mode, str) for mode in modes), "metadata['render_modes'] is no list of texts"
    assert env.render_mode is None or env.render_mode in modes, f"render_mode is {env.render_mode!r}, which metadata['render_modes'] {modes} does not hold"
    if modes:
        rate = env.metadata.get("render_fps")
        assert isinstance(rate, Real) and rate > 0, f"metadata['render_fps'] is {rate!r}; expected a number above 0"
    picture = env.render()
    if env.render_mode == "rgb_array":
        assert isinstance(picture, np.ndarray) and picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3, \
            "render() gives no (height, width, 3) array of uint8"


def _check_reset_parameters(env: Any) -> None:
    parameters = inspect.signature(env.reset).parameters
    for name in ("seed", "options"):
        assert name in parameters and parameters[name].kind is not inspect.Parameter.POSITIONAL_ONLY, f"reset() takes no keyword {name}"
        assert parameters[name].default is None, f"reset()'s {name} has the default {parameters[name].default!r} instead of None"
    assert "return_info" not in parameters, "reset() takes return_info, which Gymnasium has dropped"
    assert not callable(getattr(env, "seed", None)), "there is a function seed(), which Gymnasium has dropped; expected reset(seed=)"


def check_environment(env: Any, *, commands: int = 20, seed: int = 123) -> None:
    """Raises AssertionError with the first rule of the contract that `env` breaks.

    Args:
        env: an environment that is not used otherwise. At the end it is closed, twice.
        commands: how many steps are tried.
        seed: of the episodes and actions.
    """
    for name in ("action_space", "observation_space", "metadata", "render_mode", "np_random", "np_random_seed", "unwrapped", "spec", "reset", "step", "render",
                 "close", "has_wrapper_attr", "get_wrapper_attr", "set_wrapper_attr"):
        assert hasattr(env, name), f"there is no member {name}"
    assert env.unwrapped is env, "the environment is wrapped; expected env.unwrapped"
    _check_space(env.action_space, "action_space")
    _check_space(env.observation_space, "observation_space")
    _check_reset_parameters(env)

    def begun(**given: Any) -> Any:
        result = env.reset(**given)
        assert isinstance(result, tuple) and len(result) == 2, "reset() does not return (observation, info)"
        observation, info = result
        _check_observation(observation, env.observation_space, "the first observation")
        assert isinstance(info, dict), "reset()'s info is no dictionary"
        return observation

    def episode() -> list[Any]:
        """Observations, rewards and ends of an episode with the actions of a seed."""
        given = [begun(seed=seed)]
        path: list[Any] = [_copied(given[0])]
        env.action_space.seed(seed)
        for _ in range(commands):
            action = env.action_space.sample()
            kept = np.copy(action)
            result = env.step(action)
            assert np.array_equal(kept, action), "step() changes the action"
            assert isinstance(result, tuple) and len(result) == 5, "step() does not return (observation, reward, terminated, truncated, info)"
            observation, reward, terminated, truncated, info = result
            _check_observation(observation, env.observation_space, "an observation")
            assert isinstance(reward, float) and np.isfinite(reward), f"the reward is {reward!r}, no finite float"
            assert type(terminated) is bool and type(truncated) is bool, "terminated or truncated is no bool"
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
    # the random numbers belong to the environment: they begin anew with a seed, and go on without one
    begun(seed=seed)
    state = env.np_random.bit_generator.state
    assert env.np_random_seed == seed, f"np_random_seed is {env.np_random_seed} after reset(seed={seed})"
    begun(seed=seed)
    assert env.np_random.bit_generator.state == state, "the same seed leaves np_random in different states"
    begun(seed=seed + 1)
    assert env.np_random.bit_generator.state != state, "another seed leaves np_random in the same state"
    numbers = env.np_random
    begun()
    begun(options={})
    assert env.np_random is numbers, "reset() without a seed begins np_random anew"
    _check_render(env)
    env.close()
    env.close()


def check_vector_environment(envs: Any, *, commands: int = 20, seed: int = 123) -> None:
    """Raises AssertionError with the first rule of the contract of vector environments that `envs` breaks.

    Args:
        envs: a vector environment that is not used otherwise. At the end it is closed, twice.
        commands: how many steps are tried; rules on what follows an episode's end are tested if one ends in them.
        seed: of the episodes and actions.
    """
    for name in ("num_envs", "action_space", "observation_space", "single_action_space", "single_observation_space", "metadata", "render_mode", "spec", "closed",
                 "np_random", "unwrapped", "reset", "step", "render", "close"):
        assert hasattr(envs, name), f"there is no member {name}"
    n = envs.num_envs
    mode = envs.metadata.get("autoreset_mode")
    mode = getattr(mode, "value", mode)
    assert mode in ("NextStep", "SameStep", "Disabled"), f"metadata['autoreset_mode'] is {mode!r}"
    _check_space(envs.action_space, "action_space")
    _check_space(envs.observation_space, "observation_space")
    _check_reset_parameters(envs)
    assert envs.action_space.shape == (n, *envs.single_action_space.shape), "action_space is not num_envs times single_action_space"

    def begun(**given: Any) -> Any:
        observation, info = envs.reset(**given)
        _check_observation(observation, envs.observation_space, "the first observation")
        assert isinstance(info, dict), "reset()'s info is no dictionary"
        return _copied(observation)

    def part(observation: Any, mask: Any) -> Any:
        return {key: value[mask] for key, value in observation.items()} if isinstance(observation, dict) else observation[mask]

    first = begun(seed=seed)
    assert _same(first, begun(seed=seed)), "the same seed gives different first observations"
    assert _same(first, begun(seed=[seed + i for i in range(n)])), "a seed is not that of the first environment, with the next ones for the others"
    envs.action_space.seed(seed)
    ended = np.zeros(n, bool)
    for _ in range(commands):
        observation, rewards, terminations, truncations, info = envs.step(envs.action_space.sample())
        _check_observation(observation, envs.observation_space, "an observation")
        assert rewards.shape == (n,) and rewards.dtype == np.float64 and np.all(np.isfinite(rewards)), "the rewards are no (num_envs,) finite float64"
        for ends in (terminations, truncations):
            assert ends.shape == (n,) and ends.dtype == bool, "the ends are no (num_envs,) bool"
        assert isinstance(info, dict), "step()'s info is no dictionary"
        for key, value in info.items():
            if not key.startswith("_"):
                mask = info.get("_" + key)
                assert mask is not None and mask.shape == (n,) and mask.dtype == bool, f"info has no mask '_{key}' of (num_envs,) bool"
        if mode == "NextStep":
            assert np.all(rewards[ended] == 0) and not np.any((terminations | truncations)[ended]), "the step after an end is no new beginning"
        ended = terminations | truncations
        if mode == "SameStep" and ended.any():
            assert np.array_equal(info["_final_obs"], ended), "info['_final_obs'] is not the mask of the environments that ended"
            for one in info["final_obs"][ended]:
                _check_observation(one, envs.single_observation_space, "info['final_obs']")
        if mode == "Disabled" and ended.any():
            again = begun(options={"reset_mask": ended})
            assert _same(part(again, ~ended), part(observation, ~ended)), "reset_mask changes environments that it leaves out"
    begun(options={})
    pictures = envs.render()
    if envs.render_mode == "rgb_array":
        assert len(pictures) == n and all(one.dtype == np.uint8 and one.ndim == 3 and one.shape[2] == 3 for one in pictures), \
            "render() gives no picture (height, width, 3) of uint8 for each environment"
    envs.close()
    envs.close()
    assert envs.closed, "closed is not True after close()"
