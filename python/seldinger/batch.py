"""Many simulators stepped together on all cores."""
from __future__ import annotations

import threading
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._library import ArgumentError, Context, PathLike, StateError, ffi, lib
from .scene import Scene
from .simulator import Floats, Simulator, hands_of

_MOST = lib.SEL_TOOLS_MOST
_FLOAT = np.dtype(np.float64)
_asarray, _step, _NULL = np.asarray, lib.sel_batch_step, ffi.NULL       # found once: step() is called often

#: What a simulator of a batch shows after the last step. Of a scene with fewer tools the rest of the tools' values is 0.
ROW = np.dtype([("time_s", "f8"), ("tip_mm", "f8", 3), ("push_n", "f8", _MOST), ("torque_n_mm", "f8", _MOST), ("inserted_mm", "f8", _MOST),
                ("turned_deg", "f8", _MOST), ("wall_force_max_n", "f8"), ("wall_force_sum_n", "f8"), ("penetration_mm", "f8"), ("target_mm", "f8"),
                ("hash", "u8"), ("flags", "u4"), ("flags_ever", "u4"), ("contacts", "i4"), ("is_reached", "i4")])
assert ROW.itemsize == ffi.sizeof("SelBatchRow")


class Batch:
    """N simulators that step together. Threads of the C library share the work without the interpreter's lock; states do not depend on their number.

    Args:
        scenes: one scene for all, or a sequence of N: ``Scene`` objects, paths or dictionaries.
        count: N, if `scenes` is one scene.
        threads: 1 to 256; 0: one for each core.
        keeps_score: see ``Simulator``.

    Attributes:
        rows: (N,) structured array of type ``ROW``: a view of the library's memory that every step updates, as are the arrays below.
        commands: (N, 4, 2) push [mm/s] and twist [deg/s] of each tool: the library's own array, to be written for ``step()``.
        time_s: (N,) s.
        tips: (N, 3) mm, of the innermost tools.
        hand_force, hand_torque, inserted, turned: (N, 4) N, N mm, mm, deg.
        target_distance: (N,) mm, of the foremost tip from the scene's first target; infinite without one.
        flags: (N,) uint32, bits of ``Flag``.
        hashes: (N,) uint64 of the states, 0 unless ``wants_hashes``.

    Example:
        >>> batch = Batch("scenes/phantom/scene.yaml", 64)
        >>> batch.step([[20, 0]], n=10)                    # the same command for all
        >>> batch.tips                                     # (64, 3)
    """

    def __init__(self, scenes: Union[Scene, PathLike, Mapping[str, Any], Sequence[Union[Scene, PathLike, Mapping[str, Any]]]],
                 count: Optional[int] = None, *, threads: int = 0, keeps_score: bool = True) -> None:
        if count is None:
            if isinstance(scenes, (Scene, Mapping, str)) or hasattr(scenes, "__fspath__"):
                raise ArgumentError("count is not given; expected it beside a single scene")
            given = list(scenes)    # type: ignore[arg-type]
            opened = {id(scene): scene if isinstance(scene, Scene) else Scene(scene) for scene in given}
            self.scenes: tuple[Scene, ...] = tuple(opened[id(scene)] for scene in given)
        else:
            scene = scenes if isinstance(scenes, Scene) else Scene(scenes)  # type: ignore[arg-type]
            self.scenes = (scene,) * count
        self._context = Context()
        self._lock = threading.Lock()
        options = ffi.new("SelBatchOptions *")
        lib.sel_batch_options_init(options, ffi.sizeof("SelBatchOptions"))
        options.threads, options.keeps_score = threads, bool(keeps_score)
        handle = ffi.new("SelBatch **")
        self._context.check(lib.sel_batch_create(self._context.handle, len(self.scenes), [scene.handle for scene in self.scenes], options, handle))
        self._handle: Any = ffi.gc(handle[0], lib.sel_batch_destroy)
        n = len(self.scenes)
        owner, memory = self._handle, ffi.cast("char *", lib.sel_batch_rows(handle[0]))
        self._rows_owner = ffi.gc(memory, lambda _: owner)      # arrays over the rows keep the batch's memory
        self.rows: NDArray[np.void] = np.frombuffer(ffi.buffer(self._rows_owner, n * ROW.itemsize), ROW)
        self.rows.flags.writeable = False
        self.time_s: Floats = self.rows["time_s"]
        self.tips: Floats = self.rows["tip_mm"]
        self.hand_force: Floats = self.rows["push_n"]
        self.hand_torque: Floats = self.rows["torque_n_mm"]
        self.inserted: Floats = self.rows["inserted_mm"]
        self.turned: Floats = self.rows["turned_deg"]
        self.target_distance: Floats = self.rows["target_mm"]
        self.flags: NDArray[np.uint32] = self.rows["flags"]
        self.hashes: NDArray[np.uint64] = self.rows["hash"]
        self._hands = ffi.new("SelHand[]", n)
        self.commands, self._holds, _ = hands_of(self._hands, n)
        # for step(), which is called often: shapes of commands with their number of tools, and views of those tools and of the scenes' others
        self._shapes = {shape: k for k in range(_MOST + 1) for shape in ((k, 2), (1, k, 2), (n, k, 2))}
        self._tools = max(len(scene.tools) for scene in self.scenes)
        self._given = tuple(self.commands[:, :k] for k in range(_MOST + 1))
        self._others = tuple(self.commands[:, k:self._tools] for k in range(_MOST + 1))
        self._simulators: dict[int, Simulator] = {}

    def __len__(self) -> int:
        return len(self.scenes)

    @property
    def handle(self) -> Any:
        """The C library's handle."""
        if self._handle is None:
            raise StateError("the batch is closed")
        return self._handle

    def close(self) -> None:
        """Ends the threads and frees all simulators once no array over them is left."""
        self._handle = None
        self._simulators.clear()

    def __enter__(self) -> "Batch":
        return self

    def __exit__(self, *what: object) -> None:
        self.close()

    def step(self, commands: Optional[ArrayLike] = None, n: int = 1, *, skip: Optional[ArrayLike] = None) -> None:
        """Makes `n` steps of all simulators.

        Args:
            commands: (N, tools, 2) or, for all the same, (tools, 2): push [mm/s] and twist [deg/s], as ``Simulator.step``. Tools that are not given are
                held still. None: what was written into ``commands``.
            n: number of steps, >= 0.
            skip: (N,) True: that simulator is left as it is.

        Raises:
            ArgumentError: a command is out of range or of another shape; no step was taken.
        """
        with self._lock:
            if commands is not None:
                given = _asarray(commands, _FLOAT)
                tools = self._shapes.get(given.shape)
                if tools is None:
                    raise ArgumentError(f"commands have the shape {given.shape}; expected ({len(self)}, tools, 2) or (tools, 2)")
                self._given[tools][...] = given
                if tools < self._tools:
                    self._others[tools][...] = 0
            mask = _NULL
            if skip is not None:
                skipped = np.ascontiguousarray(skip, dtype=np.uint8)
                if skipped.shape != (len(self),):
                    raise ArgumentError(f"skip has the shape {skipped.shape}; expected ({len(self)},)")
                mask = ffi.from_buffer("unsigned char *", skipped)
            status = _step(self._handle or self.handle, self._hands, n, mask)       # the property refuses a closed batch
            if commands is not None and tools > self._tools:
                self.commands[:, self._tools:] = 0      # of tools that no scene has
            if status:
                self._context.check(status)

    def simulator(self, index: int) -> Simulator:
        """One of the simulators, to be read, reset or recorded between two steps; after a change call ``refresh``."""
        if not 0 <= index < len(self):
            raise ArgumentError(f"there is no simulator {index}; they are 0 to {len(self) - 1}")
        simulator = self._simulators.get(index)
        if simulator is None:
            simulator = self._simulators[index] = Simulator._borrowed(self.scenes[index], self.handle, index)
        return simulator

    def reset(self, index: Optional[int] = None) -> None:
        """Returns one simulator, or all, to time 0."""
        for i in range(len(self)) if index is None else (index,):
            self.simulator(i).reset()
        self.refresh()

    def refresh(self) -> None:
        """Updates the arrays after single simulators were changed."""
        with self._lock:
            self._context.check(lib.sel_batch_refresh(self.handle))

    def wants_hashes(self, are_wanted: bool = True) -> None:
        """``hashes`` are those of the states from now on, which takes about 5 us a simulator and step."""
        with self._lock:
            self._context.check(lib.sel_batch_hashes(self.handle, bool(are_wanted)))
