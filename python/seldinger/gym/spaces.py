"""Spaces of actions and observations: gymnasium's where it is installed, else the two that are needed here, with the same members."""
from __future__ import annotations

from typing import Any, Iterator, Mapping, Optional, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

try:
    import gymnasium
except ImportError:
    gymnasium = None

has_gymnasium: bool = gymnasium is not None


class _Space:
    """What both spaces share: a shape, a type and random numbers of their own."""

    def __init__(self, shape: Optional[tuple[int, ...]], dtype: Optional[np.dtype], seed: Optional[int]) -> None:
        self.shape, self.dtype = shape, dtype
        self._np_random: Optional[np.random.Generator] = None
        if seed is not None:
            self.seed(seed)

    @property
    def np_random(self) -> np.random.Generator:
        """The random numbers of ``sample``."""
        if self._np_random is None:
            self.seed()
        assert self._np_random is not None
        return self._np_random

    def seed(self, seed: Optional[int] = None) -> Any:
        """Begins the random numbers of ``sample`` anew; None: with a number of the system's. Returns the number."""
        sequence = np.random.SeedSequence(seed)
        self._np_random = np.random.Generator(np.random.PCG64(sequence))
        return sequence.entropy

    def __contains__(self, x: Any) -> bool:
        return self.contains(x)

    @property
    def is_np_flattenable(self) -> bool:
        """Whether a value can be made one flat array."""
        return True

    def contains(self, x: Any) -> bool:
        raise NotImplementedError


class OwnBox(_Space):
    """Arrays between `low` and `high`, both included.

    Args:
        low, high: numbers or arrays of `shape`.
        shape: of the arrays; None: that of `low`.
        dtype: of the arrays, a type of floats or whole numbers.
    """

    def __init__(self, low: ArrayLike, high: ArrayLike, shape: Optional[Sequence[int]] = None, dtype: Any = np.float32, seed: Optional[int] = None) -> None:
        kind = np.dtype(dtype)
        size = tuple(shape) if shape is not None else np.shape(low)
        super().__init__(size, kind, seed)
        self.low = np.broadcast_to(np.asarray(low, kind), size).copy()
        self.high = np.broadcast_to(np.asarray(high, kind), size).copy()
        if not np.all(self.low <= self.high):
            raise ValueError(f"a box from {low} to {high} is empty; expected low <= high")

    def sample(self) -> NDArray[Any]:
        """A random array: even between the bounds."""
        if self.dtype.kind in "iu":
            return self.np_random.integers(self.low, self.high, endpoint=True, dtype=self.dtype)
        return self.np_random.uniform(self.low, self.high).astype(self.dtype)

    def contains(self, x: Any) -> bool:
        """Whether x is an array of this type and shape within the bounds."""
        return (isinstance(x, np.ndarray) and np.can_cast(x.dtype, self.dtype) and x.shape == self.shape
                and bool(np.all(x >= self.low) and np.all(x <= self.high)))

    def __eq__(self, other: object) -> bool:
        return (isinstance(other, OwnBox) and self.shape == other.shape and self.dtype == other.dtype and np.array_equal(self.low, other.low)
                and np.array_equal(self.high, other.high))

    def __repr__(self) -> str:
        return f"Box({self.low.min() if self.low.size else None}, {self.high.max() if self.high.size else None}, {self.shape}, {self.dtype})"


class OwnDict(_Space):
    """Dictionaries with a value of a space for each key."""

    def __init__(self, spaces: Mapping[str, Any], seed: Optional[int] = None) -> None:
        self.spaces = dict(spaces)
        super().__init__(None, None, seed)

    def seed(self, seed: Optional[int] = None) -> Any:
        """Seeds the space of each key with a number drawn from `seed`. Returns these numbers by key."""
        super().seed(seed)
        return {key: space.seed(int(self.np_random.integers(2**31))) for key, space in self.spaces.items()}

    def sample(self) -> dict[str, Any]:
        """A random dictionary."""
        return {key: space.sample() for key, space in self.spaces.items()}

    def contains(self, x: Any) -> bool:
        """Whether x is a dictionary with these keys, and a value of its space for each."""
        return isinstance(x, dict) and x.keys() == self.spaces.keys() and all(space.contains(x[key]) for key, space in self.spaces.items())

    def __getitem__(self, key: str) -> Any:
        return self.spaces[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.spaces)

    def __len__(self) -> int:
        return len(self.spaces)

    def keys(self) -> Any:
        return self.spaces.keys()

    def values(self) -> Any:
        return self.spaces.values()

    def items(self) -> Any:
        return self.spaces.items()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OwnDict) and self.spaces == other.spaces

    def __repr__(self) -> str:
        return f"Dict({self.spaces})"


class _Random:
    """Random numbers that ``reset(seed=)`` begins anew."""

    _np_random: Optional[np.random.Generator] = None
    _np_random_seed: Optional[int] = None

    @property
    def np_random(self) -> np.random.Generator:
        """The environment's random numbers. They may be replaced; then the seed is unknown, -1."""
        if self._np_random is None:
            self._seed(None)
        assert self._np_random is not None
        return self._np_random

    @np_random.setter
    def np_random(self, numbers: np.random.Generator) -> None:
        self._np_random, self._np_random_seed = numbers, -1

    @property
    def np_random_seed(self) -> int:
        """The seed of ``np_random``."""
        if self._np_random_seed is None:
            self._seed(None)
        assert self._np_random_seed is not None
        return self._np_random_seed

    def _seed(self, seed: Optional[int]) -> None:
        if seed is not None and not (isinstance(seed, (int, np.integer)) and seed >= 0):
            raise ValueError(f"the seed is {seed!r}; expected a whole number >= 0 or None")
        sequence = np.random.SeedSequence(seed)
        self._np_random_seed = int(sequence.entropy)
        self._np_random = np.random.Generator(np.random.PCG64(sequence))

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None) -> Any:
        if seed is not None:
            self._seed(seed)

    @property
    def unwrapped(self) -> Any:
        """The environment itself: it is no wrapper."""
        return self


class OwnEnv(_Random):
    """The members of ``gymnasium.Env`` that every environment has, where that package is not installed."""

    metadata: dict[str, Any] = {"render_modes": []}
    render_mode: Optional[str] = None
    spec: Any = None
    action_space: Any
    observation_space: Any

    def close(self) -> None:
        pass

    def has_wrapper_attr(self, name: str) -> bool:
        """Whether the environment has a member."""
        return hasattr(self, name)

    def get_wrapper_attr(self, name: str) -> Any:
        """A member of the environment."""
        return getattr(self, name)

    def set_wrapper_attr(self, name: str, value: Any, *, force: bool = True) -> bool:
        """Sets a member; without `force` only one that exists. Returns whether it was set."""
        if not force and not hasattr(self, name):
            return False
        setattr(self, name, value)
        return True

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *what: object) -> bool:
        self.close()
        return False


class OwnVectorEnv(_Random):
    """The members of ``gymnasium.vector.VectorEnv``, where that package is not installed."""

    metadata: dict[str, Any] = {}
    render_mode: Optional[str] = None
    spec: Any = None
    closed: bool = False
    num_envs: int
    action_space: Any
    observation_space: Any
    single_action_space: Any
    single_observation_space: Any

    def close(self, **given: Any) -> None:
        """Frees what the environments hold. May be called twice."""
        if not self.closed:
            self.close_extras(**given)
            self.closed = True

    def close_extras(self, **given: Any) -> None:
        pass


Box: Any = gymnasium.spaces.Box if gymnasium else OwnBox
Dict: Any = gymnasium.spaces.Dict if gymnasium else OwnDict
Env: Any = gymnasium.Env if gymnasium else OwnEnv
VectorEnv: Any = gymnasium.vector.VectorEnv if gymnasium else OwnVectorEnv


def autoreset_mode_of(name: str) -> Any:
    """Gymnasium's mode of this name; the name itself where that package, or the mode in it, is missing."""
    return gymnasium.vector.AutoresetMode(name) if hasattr(getattr(gymnasium, "vector", None), "AutoresetMode") else name


def register(name: str, entry_point: str) -> None:
    """Tells Gymnasium of an environment, if it is installed and does not know it yet."""
    if gymnasium and name not in gymnasium.registry:
        gymnasium.register(id=name, entry_point=entry_point)


def batch(space: Any, count: int) -> Any:
    """The space of `count` stacked values of a space."""
    if isinstance(space, Dict):
        return Dict({key: batch(one, count) for key, one in space.spaces.items()})
    repeat = (count,) + (1,) * len(space.shape)
    return Box(np.tile(space.low, repeat), np.tile(space.high, repeat), dtype=space.dtype)
