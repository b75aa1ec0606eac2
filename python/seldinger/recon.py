"""Reconstruction: from an angiogram, or from a surface, to a vessel tree and a model of its wall. Offline: seconds to minutes, on all cores."""
from __future__ import annotations

import warnings
from typing import Any, Callable, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._library import ArgumentError, Context, PathLike, ffi, file_lock, lib, path_bytes, text_of
from .scene import TREE_NODE, query_wall
from .simulator import Floats

#: Called about ten times a second with the finished part and the whole.
Progress = Callable[[int, int], None]


class DoubtWarning(UserWarning):
    """A doubt of the library about a result, such as a vessel that the image hardly supports."""


class _Call:
    """The context of a long call: its remarks become warnings."""

    def __init__(self, progress: Optional[Progress] = None) -> None:
        self._message = ffi.callback("void(void *, SelMessageLevel, const char *)", self._warn)
        self._progress = ffi.callback("void(void *, long, long)", lambda _, done, total: progress(done, total)) if progress else ffi.NULL
        self._remarks: list[str] = []
        options = ffi.new("SelContextOptions *")
        lib.sel_context_options_init(options, ffi.sizeof("SelContextOptions"))
        options.message, options.progress = self._message, self._progress
        self.context = Context(options)

    def _warn(self, _: Any, level: int, text: Any) -> None:
        if level == lib.SEL_WARNING:
            self._remarks.append(text_of(text))

    def end(self, status: int) -> None:
        self.context.check(status)
        for remark in self._remarks:
            warnings.warn(remark, DoubtWarning, stacklevel=3)


class Volume:
    """An angiogram.

    Args:
        source: the path of a NRRD, MetaImage, NIfTI-1 or DICOM file or folder; or an array (nx, ny, nz), converted to float32.
        origin: of an array: the centre of voxel (0, 0, 0), (3,) mm.
        spacing: of an array: (3,) mm from voxel to voxel along x, y and z; or (3, 3), a row for each axis.
    """

    def __init__(self, source: Union[PathLike, NDArray[Any]], *, origin: ArrayLike = (0, 0, 0), spacing: ArrayLike = (1, 1, 1)) -> None:
        context, handle = Context(), ffi.new("SelVolume **")
        if isinstance(source, np.ndarray):
            if source.ndim != 3:
                raise ArgumentError(f"the volume has the shape {source.shape}; expected (nx, ny, nz)")
            values = np.asarray(source, dtype=np.float32).ravel(order="F")       # x fastest
            axis = np.asarray(spacing, np.float64)
            axis = np.ascontiguousarray(np.diag(axis) if axis.shape == (3,) else axis)
            start = np.ascontiguousarray(origin, dtype=np.float64)
            if axis.shape != (3, 3) or start.shape != (3,):
                raise ArgumentError(f"origin and spacing have the shapes {start.shape} and {axis.shape}; expected (3,) and (3,) or (3, 3)")
            status = lib.sel_volume_create(context.handle, list(source.shape), ffi.from_buffer("double *", start),
                                           ffi.cast("double (*)[3]", ffi.from_buffer(axis)), ffi.from_buffer("float *", values), handle)
        else:
            with file_lock:
                status = lib.sel_volume_open(context.handle, path_bytes(source), handle)
        context.check(status)
        self.handle: Any = ffi.gc(handle[0], lib.sel_volume_destroy)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nx, ny, nz)."""
        size = ffi.new("int[3]")
        lib.sel_volume_size(self.handle, size)
        return tuple(size)  # type: ignore[return-value]

    @property
    def voxel_mm(self) -> float:
        """Mean edge of a voxel [mm]."""
        return lib.sel_volume_voxel_mm(self.handle)

    def segment(self, start: ArrayLike, *, until: Sequence[ArrayLike] = (), unwanted: Sequence[ArrayLike] = (), seed: int = -1, threads: int = 0,
                progress: Optional[Progress] = None) -> "Tree":
        """Tracks the vessels. Doubts about the result are ``DoubtWarning`` warnings.

        Args:
            start: (3,) mm, a point in a vessel: the whole tree is tracked from it.
            until: points (3,) mm at which the tree ends, at most 64.
            unwanted: points (3,) mm in vessels that are not wanted, at most 64.
            seed: of the random numbers; < 0: the usual one.
            threads: 0: all cores; the result does not depend on it.
            progress: called with the work that is done and that there is.

        Raises:
            InputError: the start lies in no vessel.
        """
        call, handle, options = _Call(progress), ffi.new("SelTree **"), ffi.new("SelSegmentOptions *")
        lib.sel_segment_options_init(options, ffi.sizeof("SelSegmentOptions"))
        ends, others = (np.array(points, np.float64).reshape(-1, 3) for points in (until, unwanted))
        options.start_mm = np.asarray(start, np.float64).reshape(3).tolist()
        memory = [ffi.from_buffer("double *", ends) if len(ends) else ffi.NULL, ffi.from_buffer("double *", others) if len(others) else ffi.NULL]
        options.until_mm, options.not_mm = memory
        options.until_count, options.not_count, options.seed, options.threads = len(ends), len(others), seed, threads
        call.end(lib.sel_segment(call.context.handle, self.handle, options, handle))
        return Tree._of(handle[0])


class Tree:
    """Centreline nodes with points on the wall; after ``fit`` also a model of the wall, which a scene's ``vessel: {model: …}`` takes.

    Args:
        path: of a tree or model (HDF5).
    """

    def __init__(self, path: PathLike) -> None:
        context, handle = Context(), ffi.new("SelTree **")
        with file_lock:
            context.check(lib.sel_tree_open(context.handle, path_bytes(path), handle))
        self.handle: Any = ffi.gc(handle[0], lib.sel_tree_destroy)

    @classmethod
    def _of(cls, handle: Any) -> "Tree":
        self = cls.__new__(cls)
        self.handle = ffi.gc(handle, lib.sel_tree_destroy)
        return self

    @classmethod
    def from_surface(cls, surface: PathLike, centrelines: Sequence[PathLike] = (), *, progress: Optional[Progress] = None) -> "Tree":
        """The tree of a surface (STL, PLY, OBJ or VTP), as ``seldinger import`` makes it.

        Args:
            surface: path of the mesh, in mm.
            centrelines: paths of centrelines with radii (.vtp, .mrk.json or .swc); none: found from the surface.
            progress: called with the work that is done and that there is.
        """
        call, handle = _Call(progress), ffi.new("SelTree **")
        paths = [ffi.new("char[]", path_bytes(path)) for path in centrelines]
        with file_lock:
            call.end(lib.sel_import_surface(call.context.handle, path_bytes(surface), len(paths), paths or ffi.NULL, handle))
        return cls._of(handle[0])

    def save(self, path: PathLike) -> None:
        """Writes the tree, with its model if there is one."""
        context = Context()
        with file_lock:
            context.check(lib.sel_tree_save(context.handle, self.handle, path_bytes(path)))

    @property
    def nodes(self) -> NDArray[np.void]:
        """(N,) structured array of type ``TREE_NODE``, parents before children."""
        nodes = np.zeros(lib.sel_tree_node_count(self.handle), TREE_NODE)
        pointer = ffi.from_buffer("SelTreeNode[]", nodes)
        for i in range(len(nodes)):
            lib.sel_tree_node(self.handle, i, ffi.addressof(pointer, i))
        return nodes

    @property
    def points(self) -> Floats:
        """The points on the wall, (P, 3) mm."""
        points = np.empty((lib.sel_tree_point_count(self.handle), 3))
        Context().check(lib.sel_tree_points(self.handle, ffi.from_buffer("double *", points)))
        return points

    @property
    def is_model(self) -> bool:
        """It has a model of the wall."""
        return bool(lib.sel_tree_is_model(self.handle))

    def fit(self, *, target_mm: float = 0.0, voxel_mm: float = -1.0, edge_blur_mm: float = -1.0, threads: int = 0, progress: Optional[Progress] = None) -> "Tree":
        """A new tree with a model of the wall.

        Args:
            target_mm: largest distance wanted between points and wall; 0: chosen from the voxels.
            voxel_mm: of the angiogram; < 0: the tree's value, 0: unknown.
            edge_blur_mm: blur that has moved the points inwards; < 0: the tree's value, 0: none.
            threads: 0: all cores; the result does not depend on it.
            progress: called with the work that is done and that there is.
        """
        call, handle, options = _Call(progress), ffi.new("SelTree **"), ffi.new("SelFitOptions *")
        lib.sel_fit_options_init(options, ffi.sizeof("SelFitOptions"))
        options.target_mm, options.voxel_mm, options.edge_blur_mm, options.threads = target_mm, voxel_mm, edge_blur_mm, threads
        call.end(lib.sel_fit(call.context.handle, self.handle, options, handle))
        return Tree._of(handle[0])

    def query(self, points: ArrayLike) -> tuple[Floats, Floats]:
        """The model's wall at points, as ``Scene.query``: distance (n,) mm, positive inside, and unit normal (n, 3).

        Raises:
            StateError: the tree has no model.
        """
        return query_wall(lib.sel_tree_query, self.handle, points)
