"""Recordings, read as arrays and simulated again."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._library import Context, PathLike, ffi, file_lock, lib, path_bytes
from .scene import Scene
from .simulator import Floats


class Recording:
    """A recording that ``Simulator.record``, ``seldinger run --record`` or ``seldinger nav`` wrote, as arrays. S steps, K tools, F frames.

    Args:
        path: of the file.

    Attributes:
        step_s: [s] duration of a step.
        time_s: (S,) s, at the end of each step.
        commands: (S, K, 2) push [mm/s] and twist [deg/s].
        hashes: (S,) uint64 of the states.
        push: (S, K) N at each hand.
        torque: (S, K) N mm.
        frame_steps: (F,) int64, the steps that the frames show.
        frames: F arrays (n, 3) mm: the centreline that all tools share; n varies with several tools.

    Raises:
        InputError: the file cannot be read or is no recording.
    """

    def __init__(self, path: PathLike) -> None:
        self._context = Context()
        handle = ffi.new("SelRecording **")
        with file_lock:
            self._context.check(lib.sel_recording_open(self._context.handle, path_bytes(path), handle))
        self.handle: Any = ffi.gc(handle[0], lib.sel_recording_destroy)
        steps, tools = lib.sel_recording_steps(self.handle), lib.sel_recording_tool_count(self.handle)
        self.step_s: float = lib.sel_recording_step_s(self.handle)
        self.time_s: Floats = np.arange(1, steps + 1) * self.step_s
        self.commands: Floats = np.zeros((steps, tools, 2))
        self.hashes: NDArray[np.uint64] = np.zeros(steps, np.uint64)
        self.push: Floats = np.zeros((steps, tools))
        self.torque: Floats = np.zeros((steps, tools))
        self._context.check(lib.sel_recording_arrays(self.handle, ffi.from_buffer("double *", self.commands), ffi.from_buffer("uint64_t *", self.hashes),
                                                     ffi.from_buffer("double *", self.push), ffi.from_buffer("double *", self.torque)))
        self.frames, self.frame_steps = self._read_frames()

    def __len__(self) -> int:
        return len(self.time_s)

    def _read_frames(self) -> tuple[list[Floats], NDArray[np.int64]]:
        count = lib.sel_recording_frames(self.handle)
        step, nodes = ffi.new("int64_t *"), ffi.new("int *")
        frames, steps = [], np.zeros(count, np.int64)
        for i in range(count):
            self._context.check(lib.sel_recording_frame(self.handle, i, step, ffi.NULL, 0, nodes))
            rows = np.empty((nodes[0], 3))
            self._context.check(lib.sel_recording_frame(self.handle, i, step, ffi.from_buffer("double *", rows), nodes[0], nodes))
            frames.append(rows)
            steps[i] = step[0]
        return frames, steps

    def scene(self, *, contact: Optional[str] = None) -> Scene:
        """The recorded scene; files that it refers to are read from their original paths.

        Args:
            contact: see ``Scene``.
        """
        options = ffi.new("SelOpenOptions *")
        lib.sel_open_options_init(options, ffi.sizeof("SelOpenOptions"))
        text = ffi.new("char[]", contact.encode()) if contact else ffi.NULL
        options.contact = text
        context, handle = Context(), ffi.new("SelScene **")
        with file_lock:
            context.check(lib.sel_recording_scene(context.handle, self.handle, options, handle))
        return Scene._of(context, handle[0])

    def verify(self, scene: Optional[Scene] = None) -> Optional[int]:
        """Simulates the recording again and compares every state. Returns the first step that differs, None if none does.

        Args:
            scene: None: the recorded one.
        """
        scene = scene or self.scene()
        verdict = ffi.new("SelVerdict *")
        status = lib.sel_recording_verify(self._context.handle, self.handle, scene.handle, verdict)
        if status == lib.SEL_DIFFERENT:
            return verdict.first_different
        self._context.check(status)
        return None
