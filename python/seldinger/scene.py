"""Scenes: a vessel, one to four tools, the place where they enter, and a script of the hands."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._library import Context, InputError, PathLike, ffi, file_lock, lib, path_bytes, text_of


class Target(NamedTuple):
    """A place that a tool has to reach."""

    name: str
    point: NDArray[np.float64]     #: (3,) mm
    radius: float                  #: mm


def scene_path(name: str) -> str:
    """The path of a scene that comes with the program, such as "phantom/scene.yaml" or "exercises/aneurysm.yaml".

    Raises:
        InputError: there is no such scene.
    """
    here = Path(__file__)
    folders = (here.resolve().parents[2] / "scenes", here.parents[4] / "share/seldinger/scenes")       # of the source tree, or installed
    for folder in folders:
        if (folder / name).is_file():
            return str(folder / name)
    raise InputError(f"there is no scene {name!r} in {' or '.join(map(str, folders))}; expected a name such as 'phantom/scene.yaml'")


def _plain(value: Any) -> Any:
    """What JSON has no form for: arrays, numbers of numpy and paths."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"a scene cannot hold a {type(value).__name__}: {value!r}; expected a number, text, list or dictionary")


def scene_text(scene: Mapping[str, Any]) -> str:
    """A dictionary with the keys of a scene file as the text of one. JSON is YAML."""
    return json.dumps({"seldinger": 1, **scene}, default=_plain, allow_nan=False, indent=1)


class Scene:
    """What is simulated. A scene does not change; any number of simulators, in any threads, may share one.

    Args:
        scene: the path of a scene file or of a case's folder, or a dictionary with the keys of a scene file
            (docs/scene-format.md).
        folder: of a dictionary: where relative files are looked for; default: the current folder.
        contact: representation of the wall instead of the scene's: "lim", "sweep", "mesh", "grid", "tube", ….
        script: path of a script (CSV) instead of the scene's.
        threads: of a fit; 0: all cores. The result does not depend on it.

    Raises:
        InputError: the scene is not valid; `faults` lists all that is wrong, with line and column.
    """

    def __init__(self, scene: Union[PathLike, Mapping[str, Any]], *, folder: PathLike = ".", contact: Optional[str] = None,
                 script: Optional[PathLike] = None, threads: int = 0) -> None:
        self._context = Context()
        options = ffi.new("SelOpenOptions *")
        lib.sel_open_options_init(options, ffi.sizeof("SelOpenOptions"))
        texts = [ffi.new("char[]", contact.encode()) if contact else ffi.NULL, ffi.new("char[]", path_bytes(script)) if script else ffi.NULL]
        options.contact, options.script = texts
        options.threads = threads
        handle = ffi.new("SelScene **")
        with file_lock:
            if isinstance(scene, Mapping):
                text = scene_text(scene).encode()
                path = path_bytes(os.path.join(os.fspath(folder), "scene.yaml"))
                status = lib.sel_scene_parse(self._context.handle, text, len(text), path, options, handle)
            else:
                status = lib.sel_scene_open(self._context.handle, path_bytes(scene), options, handle)
        self._context.check(status)
        self._adopt(handle[0])

    @classmethod
    def _of(cls, context: Context, handle: Any) -> "Scene":
        self = cls.__new__(cls)
        self._context = context
        self._adopt(handle)
        return self

    def _adopt(self, handle: Any) -> None:
        self.handle = ffi.gc(handle, lib.sel_scene_destroy)
        #: The names of the tools, the outermost first.
        self.tools: tuple[str, ...] = tuple(text_of(lib.sel_scene_tool_name(handle, k)) for k in range(lib.sel_scene_tool_count(handle)))
        self.targets: tuple[Target, ...] = tuple(self._target(k) for k in range(lib.sel_scene_target_count(handle)))
        #: [s] duration of a simulation step.
        self.step_s: float = lib.sel_scene_step_s(handle)
        #: [s] duration of the script; 0: there is none.
        self.script_s: float = lib.sel_scene_script_s(handle)

    def _target(self, index: int) -> Target:
        target = ffi.new("SelTarget *")
        lib.sel_scene_target(self.handle, index, target)
        return Target(text_of(target.name), np.array(list(target.point_mm)), target.radius_mm)

    @property
    def text(self) -> str:
        """The scene's YAML."""
        return text_of(lib.sel_scene_text(self.handle))

    @property
    def entry(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the tools enter: the sheath's mouth, (3,) mm, and the unit direction of advance, (3,)."""
        point, direction = np.empty(3), np.empty(3)
        lib.sel_scene_entry(self.handle, ffi.from_buffer("double *", point), ffi.from_buffer("double *", direction))
        return point, direction

    @property
    def view(self) -> tuple[float, float, NDArray[np.float64], NDArray[np.float64]]:
        """The view that the scene asks for: the C-arm's LAO and CRA angles [deg], and the patient's axes forwards and headwards, (3,) each."""
        angles, anterior, superior = np.zeros(2), np.empty(3), np.empty(3)
        lao, cra = (ffi.from_buffer("double *", angles[i:i + 1]) for i in range(2))
        lib.sel_scene_view(self.handle, lao, cra, ffi.from_buffer("double *", anterior), ffi.from_buffer("double *", superior))
        return float(angles[0]), float(angles[1]), anterior, superior

    def query(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The wall at points.

        Args:
            points: (n, 3) mm.

        Returns:
            The distance to the wall, (n,) mm, positive in the lumen, infinite beyond an open end; and the unit normal into the lumen,
            (n, 3), zero where there is none.

        Raises:
            StateError: the scene has no wall.
        """
        return query_wall(lib.sel_scene_query, self.handle, points)


def query_wall(function: Any, handle: Any, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Queries of a scene and of a model are the same."""
    point = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    gap, normal = np.empty(len(point)), np.empty((len(point), 3))
    context = Context()
    context.check(function(context.handle, handle, len(point), ffi.from_buffer("double *", point), ffi.from_buffer("double *", gap),
                           ffi.from_buffer("double *", normal)))
    return gap, normal
