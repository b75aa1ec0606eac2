"""A scene as an environment: hands are the actions, what the C-arm and the hands feel are the observations, the score is the reward."""
from __future__ import annotations

import dataclasses
from typing import Any, Callable, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._library import ArgumentError, PathLike, StateError
from ..scene import Scene
from ..simulator import Flag, Simulator
from .spaces import Box, Dict, Env
from .view import CArm

OBSERVATIONS = ("tip", "shaft", "target", "inserted", "turned", "force", "image")
REWARDS = ("score", "steve")
FAR_MM, STRONG = 1000.0, 1000.0          # bounds of observations, which are cut there


@dataclasses.dataclass(frozen=True)
class Start:
    """How episodes begin: each figure is drawn evenly between two numbers by the environment's random numbers.

    Attributes:
        inserted_mm: the innermost tool, or the only one, is first pushed in by this.
        turned_deg: it is first turned by this.
        push_gain, twist_gain: all pushes and twists of the episode are multiplied by these: a hand that is not quite another's.
    """

    inserted_mm: tuple[float, float] = (0.0, 0.0)
    turned_deg: tuple[float, float] = (0.0, 0.0)
    push_gain: tuple[float, float] = (1.0, 1.0)
    twist_gain: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            low, high = getattr(self, field.name)
            least = -np.inf if field.name == "turned_deg" else 0
            if not (least <= low <= high < np.inf):
                raise ArgumentError(f"{field.name} is ({low}, {high}); expected two numbers, the lower one first"
                                    + ("" if least < 0 else " and at least 0"))


SceneOrDraw = Union[Scene, PathLike, Mapping[str, Any], Callable[[np.random.Generator], Scene]]


@dataclasses.dataclass(frozen=True)
class VesselEnds:
    """Where a vessel ends: nodes of its centrelines, outwards from which there are no others. The inlet, where the tools enter, is none."""

    center_mm: NDArray[np.float64]      #: (n, 3) of all nodes
    direction: NDArray[np.float64]      #: (n, 3) from the inlet outwards
    is_end: NDArray[np.bool_]           #: (n,)

    def are_reached(self, point: NDArray[np.float64]) -> bool:
        """Whether a point, (3,) mm, has passed the last node of a vessel: that node is the nearest of all and the point lies beyond it."""
        nearest = int(np.argmin(np.sum((self.center_mm - point) ** 2, axis=1)))
        return bool(self.is_end[nearest] and np.dot(point - self.center_mm[nearest], self.direction[nearest]) >= 0)


def vessel_ends_of(scene: Scene) -> VesselEnds:
    """The ends of a scene's vessels; sacs of aneurysms have none."""
    nodes = scene.nodes
    is_vessel = nodes["is_aneurysm"] == 0
    is_end = is_vessel.copy()
    is_end[nodes["parent"][is_vessel & (nodes["parent"] >= 0)]] = False      # what only a sac continues is an end
    return VesselEnds(nodes["center_mm"][is_vessel], nodes["direction"][is_vessel], is_end[is_vessel])


class Navigation(Env):
    """Steer the tools of a scene to its target: an environment with the interface of Gymnasium.

    Args:
        scene: a ``Scene``, a path or a dictionary, with a target; for the reward "score" with an ``exercise:``. Or a function that draws the
            scene of each episode from the environment's random numbers (numpy.random.Generator); all have the same tools.
        observe: the parts of an observation, a dictionary with these keys and float32 arrays:
            "tip": (tools, 2) mm, the tips in the C-arm's plane, from the middle between entry and target;
            "shaft": (shaft_points, 2) mm, points of the innermost tool behind its tip, in the same plane;
            "target": (2,) mm, the target there;
            "inserted": (tools,) mm beyond the sheath; "turned": (tools, 2), cosine and sine of each hand's turn;
            "force": (tools, 2), each hand's push [N] and torque [N mm];
            "image": (image_size, image_size) uint8, the X-ray picture.
        reward: "score": the change of the exercise's points / 100, so that an episode's rewards add up to its score / 100, less what the
            start had gained; "steve": as stEVE_bench has it, 1 at the target, 0.001 for each mm of the way to it that is gained, -0.005 a command.
        push_mm_s, twist_deg_s: the fastest hands.
        command_s: [s] for which a command holds; a multiple of the scene's step is taken.
        commands: after so many an episode is truncated; None: never.
        vessel_ends: True: an episode is truncated where the innermost tip reaches the end of a vessel without the target, as stEVE's VesselEnd does.
        start: how episodes vary; None: as the scene begins.
        shaft_points, shaft_spacing_mm: number and distance of the shaft's points.
        image_size: side of pictures in pixels, 8 to 4096.
        render_mode: "rgb_array", or None.

    An action is a float32 array (tools, 2), push [mm/s] and twist [deg/s] of each tool, the outermost first; what is beyond the fastest
    hands is cut. An episode ends (terminated) when the target is reached; it is truncated after `commands`, at the exercise's time limit, with
    `vessel_ends` at a vessel's end, and if the simulation diverges. The same seed and actions give the same bits.

    ``info`` holds "success", "distance_mm" from the innermost tip to the target, "points", "errors", "time_s", "diverged", "vessel_end"
    (False without `vessel_ends`) and "start", the drawn figures of the start.

    ``reset(options=)`` takes the names of ``Start`` with a number each instead of a drawn one, and "record": path of a recording of the
    episode, which ends with it.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}

    def __init__(self, scene: SceneOrDraw, *, observe: Sequence[str] = ("tip", "shaft", "target", "inserted", "turned", "force"),
                 reward: str = "score", push_mm_s: float = 35.0, twist_deg_s: float = 180.0, command_s: float = 0.1, commands: Optional[int] = None,
                 vessel_ends: bool = False, start: Optional[Start] = None, shaft_points: int = 3, shaft_spacing_mm: float = 2.0, image_size: int = 128,
                 render_mode: Optional[str] = None) -> None:
        self._draw = scene if callable(scene) else None
        if callable(scene):
            scene = scene(np.random.default_rng(0))         # any: spaces are alike
        self.scene: Scene = scene if isinstance(scene, Scene) else Scene(scene)
        unknown = [name for name in observe if name not in OBSERVATIONS]
        if unknown or not observe:
            raise ArgumentError(f"unknown observation {unknown}; expected some of {', '.join(OBSERVATIONS)}")
        if reward not in REWARDS:
            raise ArgumentError(f"unknown reward {reward!r}; expected {' or '.join(REWARDS)}")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ArgumentError(f"unknown render_mode {render_mode!r}; expected None or 'rgb_array'")
        if not self.scene.targets:
            raise ArgumentError("the scene has no target; an environment needs `targets:`")
        if commands is not None and not commands >= 1:
            raise ArgumentError(f"commands is {commands}; expected at least 1, or None")
        self.render_mode = render_mode
        self._sim: Any = Simulator(self.scene)
        if reward == "score" and not self._sim.score()["way_mm"] > 0:
            raise ArgumentError("the scene has no exercise, so that there is no score; expected `exercise:` in it, or reward='steve'")
        self._reward, self._observe, self._start, self._image_size = reward, tuple(observe), start or Start(), image_size
        if vessel_ends and not len(self.scene.nodes):
            raise ArgumentError("the scene's vessel has no centrelines, so that its ends are not known; expected a model or a shape, or vessel_ends=False")
        self._has_ends = bool(vessel_ends)
        self._commands, self._steps = commands, max(1, round(command_s / self.scene.step_s))
        self._spacing, self._shaft_points = shaft_spacing_mm, shaft_points
        self.metadata = dict(self.metadata, render_fps=1 / (self._steps * self.scene.step_s))
        self._look()
        tools = len(self.scene.tools)
        fastest = np.tile(np.array([push_mm_s, twist_deg_s], np.float32), (tools, 1))
        self.action_space = Box(-fastest, fastest, dtype=np.float32)

        def floats(bound: float, *shape: int) -> Any:
            return Box(-bound, bound, shape, np.float32)
        spaces = {"tip": floats(FAR_MM, tools, 2), "shaft": floats(FAR_MM, shaft_points, 2), "target": floats(FAR_MM, 2), "inserted": floats(10 * FAR_MM, tools),
                  "turned": floats(1, tools, 2), "force": floats(STRONG, tools, 2), "image": Box(0, 255, (image_size, image_size), np.uint8)}
        self.observation_space = Dict({name: spaces[name] for name in observe})
        self._is_running = False

    # --- Gymnasium's interface ---

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: begins the environment's random numbers anew; None: they go on.
            options: see the class.

        Returns:
            The first observation, and ``info``.
        """
        super().reset(seed=seed)
        given = dict(options or {})
        record = given.pop("record", None)
        drawn: dict[str, float] = {}
        for field in dataclasses.fields(Start):      # always all of them, so that an option does not change the others
            low, high = getattr(self._start, field.name)
            drawn[field.name] = float(self.np_random.uniform(low, high))
            if field.name in given:
                drawn[field.name] = float(given.pop(field.name))
        if given:
            raise ArgumentError(f"unknown options {', '.join(given)}; expected {', '.join(drawn)} or record")
        self._end_recording()
        if self._draw is None:
            self.simulator.reset()
        else:
            self.simulator.close()
            self.scene = self._draw(self.np_random)
            self._sim = Simulator(self.scene)
            self._look()
        if record is not None:
            self._sim.record(record)
        self._drawn = drawn
        self._gain = np.array([drawn["push_gain"], drawn["twist_gain"]])
        self._move_to_start()
        self._taken, self._is_running = 0, True
        self._measure()
        return self._observation(), self._info()

    def step(self, action: ArrayLike) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Holds a command for ``command_s``.

        Args:
            action: (tools, 2), push [mm/s] and twist [deg/s] of each tool.

        Returns:
            Observation, reward, whether the target was reached, whether the episode was cut off, and ``info``.

        Raises:
            StateError: before ``reset``, or after the end of an episode.
            ArgumentError: the action has another shape, or is not finite.
        """
        self._sim.step(self._command_of(action), n=self._steps)
        before = self._worth
        self._taken += 1
        self._measure()
        reward = self._worth - before
        if self._reward == "steve":
            reward += self._success - 0.005
        is_late = self._score["state"] == "time_out" or (self._commands is not None and self._taken >= self._commands)
        truncated = bool(not self._success and (is_late or self._diverged or self._is_at_end))
        self._is_running = not (self._success or truncated)
        if not self._is_running:
            self._end_recording()
        return self._observation(), float(reward), bool(self._success), truncated, self._info()

    def render(self) -> Optional[NDArray[np.uint8]]:
        """The X-ray picture as (image_size, image_size, 3) uint8; None if there is no ``render_mode``."""
        if self.render_mode is None:
            return None
        return np.repeat(self._image()[:, :, None], 3, axis=2)

    def close(self) -> None:
        """Ends a recording and frees the simulator. May be called twice."""
        if self._sim is not None:
            self._end_recording()
            self._sim.close()
        self._sim, self._is_running = None, False

    @property
    def simulator(self) -> Simulator:
        """The simulator of the episode; to read, not to step."""
        if self._sim is None:
            raise StateError("the environment is closed")
        return self._sim

    # --- parts ---

    def _look(self) -> None:
        """Points the C-arm at the scene."""
        self._target = self.scene.targets[0]
        self._c_arm = CArm(self.scene, 0.5 * (self.scene.entry[0] + self._target.point))
        self._ends = vessel_ends_of(self.scene) if self._has_ends else None

    def _command_of(self, action: ArrayLike) -> NDArray[np.float64]:
        """The command of an action, (tools, 2): cut at the fastest hands, times the gains of this episode's hand."""
        if not self._is_running:
            raise StateError("no episode is running; call reset() first")
        given = np.asarray(action, np.float64)
        if given.shape != self.action_space.shape or not np.all(np.isfinite(given)):
            raise ArgumentError(f"the action is {action!r}; expected {self.action_space.shape} finite numbers: push [mm/s] and twist [deg/s] of "
                                + ", ".join(self.scene.tools))
        return np.clip(given, self.action_space.low, self.action_space.high) * self._gain

    def _move_to_start(self) -> None:
        """Pushes and turns the innermost tool at an easy pace, 20 mm/s and 180 deg/s."""
        push, turn = self._drawn["inserted_mm"], self._drawn["turned_deg"]
        duration = max(push / 20, abs(turn) / 180)
        count = int(np.ceil(duration / self.scene.step_s))
        if count:
            command = np.zeros((len(self.scene.tools), 2))
            command[-1] = np.array([push, turn]) / (count * self.scene.step_s)
            self._sim.step(command, n=count)

    def _measure(self) -> None:
        """Reads what rewards and ends depend on."""
        self._score = self._sim.score()
        self._distance = float(np.linalg.norm(self._sim.tip - self._target.point))
        self._diverged = bool(self._sim.flags_ever & Flag.DIVERGED)
        self._is_at_end = self._ends is not None and self._ends.are_reached(self._sim.tip)
        if self._reward == "score":
            self._success = self._score["state"] == "reached"
            self._worth = self._score["points"] / 100
        else:
            self._success = self._distance < self._target.radius
            self._worth = -0.001 * (self._score["remaining_mm"] if self._score["way_mm"] > 0 else self._distance)

    def _observation(self) -> dict[str, Any]:
        sim, parts = self._sim, {}
        tools = range(len(self.scene.tools))
        turned = np.radians(sim.turned)
        for name in self._observe:
            if name == "tip":
                parts[name] = self._c_arm.project([sim.tip_of(k) for k in tools])
            elif name == "shaft":
                parts[name] = self._c_arm.project(self._shaft())
            elif name == "target":
                parts[name] = self._c_arm.project(self._target.point)
            elif name == "inserted":
                parts[name] = sim.inserted
            elif name == "turned":
                parts[name] = np.stack([np.cos(turned), np.sin(turned)], axis=-1)
            elif name == "force":
                parts[name] = np.stack([sim.hand_force, sim.hand_torque], axis=-1)
        cut = {name: np.clip(value, self.observation_space[name].low, self.observation_space[name].high).astype(np.float32) for name, value in parts.items()}
        if "image" in self._observe:
            cut["image"] = self._image()
        return {name: cut[name] for name in self._observe}

    def _shaft(self) -> NDArray[np.float64]:
        """Points of the innermost tool behind its tip, (shaft_points, 3) mm; beyond its end, the end."""
        nodes = self._sim.table(len(self.scene.tools) - 1)
        s = nodes["s_mm"]
        at = s[-1] - self._spacing * np.arange(1, self._shaft_points + 1)
        return np.stack([np.interp(at, s, nodes["position_mm"][:, k]) for k in range(3)], axis=-1)

    def _image(self) -> NDArray[np.uint8]:
        return self.simulator.image(self._c_arm.lao_deg, self._c_arm.cra_deg, self._image_size)

    def _info(self) -> dict[str, Any]:
        return {"success": bool(self._success), "distance_mm": self._distance, "points": self._score["points"], "errors": self._score["errors"],
                "time_s": self._sim.time_s, "diverged": self._diverged, "vessel_end": bool(self._is_at_end), "start": dict(self._drawn)}

    def _end_recording(self) -> None:
        if self.simulator.is_recording:
            self.simulator.end_recording()
