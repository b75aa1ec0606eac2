"""Scenes: a vessel, one to four tools, the place where they enter, and a script of the hands."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Mapping, NamedTuple, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._library import Context, InputError, PathLike, ffi, file_lock, lib, path_bytes, text_of


#: A node of a tree: fields ``center_mm`` (3), ``direction`` (3, unit, away from the root), ``radius_mm``, ``parent`` (-1: the root), ``is_aneurysm``.
TREE_NODE = np.dtype([("center_mm", "f8", 3), ("direction", "f8", 3), ("radius_mm", "f8"), ("parent", "i4"), ("is_aneurysm", "i4")])
assert TREE_NODE.itemsize == ffi.sizeof("SelTreeNode")


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
    """What is simulated. A scene does not change (``with_values`` makes another one); any number of simulators, in any threads, may share one.

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
        self._options: dict[str, Any] = {"contact": contact, "script": script, "threads": threads}
        if isinstance(scene, Mapping):
            self._path = os.path.join(os.fspath(folder), "scene.yaml")
            self._open(scene_text(scene))
        else:
            self._path = os.fspath(scene)
            self._open(None)

    def _open(self, text: Optional[str]) -> None:
        """Opens the text of a scene, whose relative files are looked for beside the path; None: the file at the path."""
        self._context = Context()
        options = ffi.new("SelOpenOptions *")
        lib.sel_open_options_init(options, ffi.sizeof("SelOpenOptions"))
        contact, script = self._options["contact"], self._options["script"]
        texts = [ffi.new("char[]", contact.encode()) if contact else ffi.NULL, ffi.new("char[]", path_bytes(script)) if script else ffi.NULL]
        options.contact, options.script = texts
        options.threads = self._options["threads"]
        handle = ffi.new("SelScene **")
        with file_lock:
            if text is None:
                status = lib.sel_scene_open(self._context.handle, path_bytes(self._path), options, handle)
            else:
                data = text.encode()
                status = lib.sel_scene_parse(self._context.handle, data, len(data), path_bytes(self._path), options, handle)
        self._context.check(status)
        self._adopt(handle[0])

    def with_values(self, values: Mapping[str, Any]) -> "Scene":
        """The same scene with other values.

        Args:
            values: by key, with names and indices from the root: ``{"vessel.friction": 0.1, "targets.0.point_mm": [1, 2, 3]}``.

        Raises:
            InputError: there is no such key, or the scene is not valid with its value.
        """
        text, context = self.text, Context()
        for key, value in values.items():
            changed = ffi.new("char **")
            context.check(lib.sel_scene_text_with(context.handle, text.encode(), key.encode(), json.dumps(value, default=_plain, allow_nan=False).encode(), changed))
            text = text_of(changed[0])
            lib.sel_free(changed[0])
        other = Scene.__new__(Scene)
        other._options = self._options
        other._path = os.path.join(self._path, "scene.yaml") if os.path.isdir(self._path) else self._path
        other._open(text)
        return other

    @classmethod
    def _of(cls, context: Context, handle: Any) -> "Scene":
        self = cls.__new__(cls)
        self._context, self._path = context, "scene.yaml"
        self._options = {"contact": None, "script": None, "threads": 0}
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
    def nodes(self) -> NDArray[np.void]:
        """The centrelines of a vessel that is a model or a shape, (n,) of type ``TREE_NODE``, parents before children; of any other vessel n is 0."""
        nodes = np.zeros(lib.sel_scene_node_count(self.handle), TREE_NODE)
        memory = ffi.from_buffer("SelTreeNode[]", nodes) if len(nodes) else None
        for i in range(len(nodes)):
            lib.sel_scene_node(self.handle, i, ffi.addressof(memory, i))
        return nodes

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
