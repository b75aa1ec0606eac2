"""The simulator: advances a scene by the commands of the hands; poses, forces, contacts, score and recording."""
from __future__ import annotations

import enum
import json
import threading
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._library import ArgumentError, Context, PathLike, StateError, ffi, file_lock, lib, path_bytes, text_of
from .scene import Scene, Target

Floats = NDArray[np.float64]

#: A node of a tool: fields ``s_mm`` (arc length from the proximal end), ``position_mm`` (3), ``quaternion`` (4: w, x, y, z, the tool's
#: frame in space, x along the tool), ``radius_mm``, ``carrier`` (the outermost tool at this place; -1: in the sheath).
NODE = np.dtype([("s_mm", "f8"), ("position_mm", "f8", 3), ("quaternion", "f8", 4), ("radius_mm", "f8"), ("carrier", "i4")], align=True)
#: A place where the wall presses: fields ``node`` and ``s_mm`` of the shared centreline, ``position_mm`` (3), ``force_n`` (3, from the wall
#: on the tool), ``gap_mm`` (negative in penetration).
CONTACT = np.dtype([("node", "i4"), ("s_mm", "f8"), ("position_mm", "f8", 3), ("force_n", "f8", 3), ("gap_mm", "f8")], align=True)
assert NODE.itemsize == ffi.sizeof("SelNode") and CONTACT.itemsize == ffi.sizeof("SelContact")


class Flag(enum.IntFlag):
    """What the last step reports (``Simulator.flags``)."""

    DIVERGED = lib.SEL_STEP_DIVERGED                  #: the previous state was kept; the run cannot be trusted
    NOT_CONVERGED = lib.SEL_STEP_NOT_CONVERGED        #: the contact solution stopped at its limit of iterations
    DEEP = lib.SEL_STEP_DEEP                          #: a node is more than 0.2 mm outside the wall
    FULLY_INSERTED = lib.SEL_STEP_FULLY_INSERTED      #: the whole tool is in: the rest of the advance was refused
    FULLY_WITHDRAWN = lib.SEL_STEP_FULLY_WITHDRAWN    #: the same for retraction
    OUT_OF_VESSEL = lib.SEL_STEP_OUT_OF_VESSEL        #: a node is beyond an open end that is not the sheath's
    DETECTION_UNSURE = lib.SEL_STEP_DETECTION_UNSURE  #: a projection to the wall did not converge
    LIMITED = lib.SEL_STEP_LIMITED                    #: the motion was cut short; later steps complete it
    MODEL_DISAGREES = lib.SEL_STEP_MODEL_DISAGREES    #: two parts of the vessel's model contradict each other
    HAND_SLIPS = lib.SEL_STEP_HAND_SLIPS              #: the tool's resistance exceeded the force that the hand holds


def hands_of(memory: Any, count: int) -> tuple[Floats, NDArray[np.int32], Floats]:
    """Arrays over the memory of `count` SelHand: rates (count, 4, 2), released and device (count, 4, 2), contrast (count,)."""
    size, tool = ffi.sizeof("SelHand"), ffi.sizeof("SelCommand")
    buffer = ffi.buffer(memory, count * size)
    most = lib.SEL_TOOLS_MOST
    rates = np.ndarray((count, most, 2), np.float64, buffer, 0, (size, tool, 8))
    holds = np.ndarray((count, most, 2), np.int32, buffer, 16, (size, tool, 4))
    contrast = np.ndarray((count,), np.float64, buffer, most * tool, (size,))
    return rates, holds, contrast


class Simulator:
    """A scene in motion.

    Args:
        scene: a ``Scene``, or what ``Scene()`` takes: a path or a dictionary.
        record: path of a recording of all steps (``Simulator.record``); None: none.
        keeps_score: False saves about 1 us a step, and permits ``clone``; there is then no ``score``.

    A simulator may be used in several threads, one call at a time. ``step`` releases the GIL.

    Example:
        >>> sim = Simulator("scenes/phantom/scene.yaml")
        >>> sim.step([[20, 0]], n=1000)          # push 20 mm/s for a second
        >>> sim.tip, sim.hand_force
    """

    def __init__(self, scene: Union[Scene, PathLike, Mapping[str, Any]], *, record: Optional[PathLike] = None, keeps_score: bool = True) -> None:
        self.scene: Scene = scene if isinstance(scene, Scene) else Scene(scene)
        self._context = Context()
        self._lock = threading.Lock()
        options = ffi.new("SelSimulatorOptions *")
        lib.sel_simulator_options_init(options, ffi.sizeof("SelSimulatorOptions"))
        options.keeps_score = bool(keeps_score)
        handle = ffi.new("SelSimulator **")
        self._context.check(lib.sel_simulator_create(self._context.handle, self.scene.handle, options, handle))
        self._begin(ffi.gc(handle[0], lib.sel_simulator_destroy))
        if record is not None:
            self.record(record)

    @classmethod
    def _borrowed(cls, scene: Scene, batch: Any, index: int) -> "Simulator":
        """A simulator of a batch, which keeps the batch alive."""
        self = cls.__new__(cls)
        self.scene, self._lock = scene, threading.Lock()
        handle = lib.sel_batch_simulator(batch, index)
        self._context = Context(borrowed=lib.sel_simulator_context(handle))
        self._begin(ffi.gc(handle, lambda _: batch))
        return self

    def _begin(self, handle: Any) -> None:
        self._handle: Any = handle
        self._is_recording = False
        self._hand = ffi.new("SelHand *")
        rates, holds, _ = hands_of(self._hand, 1)
        self._rates, self._holds = rates[0, :len(self.tools)], holds[0, :len(self.tools)]
        self._table: dict[int, Any] = {}
        self._report = ffi.new("SelReport *")
        self._reported = -1

    # --- life ---

    @property
    def handle(self) -> Any:
        """The C library's handle, for functions that this package does not wrap."""
        if self._handle is None:
            raise StateError("the simulator is closed")
        return self._handle

    def close(self) -> None:
        """Ends a recording and frees the simulator. Arrays of ``centreline`` must not be used afterwards."""
        if self._handle is None:
            return
        if self._is_recording:
            self.end_recording()
        with self._lock:
            ffi.release(self._handle)
            self._handle = None

    def __enter__(self) -> "Simulator":
        return self

    def __exit__(self, *what: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<seldinger.Simulator of {', '.join(self.tools)} at {self.time_s:g} s>" if self._handle is not None else "<seldinger.Simulator, closed>"

    def reset(self) -> None:
        """Returns to time 0. The next steps are those of a new simulator, bit for bit.

        Raises:
            StateError: a recording runs.
        """
        with self._lock:
            self._context.check(lib.sel_simulator_reset(self.handle))
            self._reported = -1
            for table in self._table.values():
                table.steps = -1

    def clone(self) -> "Simulator":
        """A second simulator in the same state; the same commands take both through the same states, bit for bit.

        Raises:
            StateError: it keeps a score, or a recording runs.
        """
        other = Simulator(self.scene, keeps_score=False)
        other.copy_from(self)
        return other

    def copy_from(self, other: "Simulator") -> None:
        """Takes over the state of another simulator of the same ``scene`` object: faster than ``clone`` in a search.

        Raises:
            StateError: one of them keeps a score or records.
        """
        with self._lock:
            self._context.check(lib.sel_simulator_copy(self.handle, other.handle))
            self._reported = -1
            for table in self._table.values():
                table.steps = -1

    # --- steps ---

    def step(self, commands: Optional[ArrayLike] = None, n: int = 1, *, released: Optional[Sequence[bool]] = None,
             device: Optional[Sequence[int]] = None, contrast: tuple[float, int] = (0.0, 0)) -> None:
        """Makes `n` steps of ``scene.step_s`` with one command.

        Args:
            commands: (tools, 2), the outermost tool first: push [mm/s], positive into the patient, -1000 to 1000, and twist [deg/s],
                right-handed about the direction of advance, -36000 to 36000; (2,) if there is one tool; None: every tool is held still.
            n: number of steps, >= 0.
            released: (tools,) True: no hand holds the tool.
            device: (tools,) the device requested: 0 the tool itself, 1, 2, … those of its ``exchange:``.
            contrast: contrast agent [ml/s], 0 to 50, and the tool that it flows through, 1 the outermost; 0: none.

        A numerical problem is no error: see ``flags``.

        Raises:
            ArgumentError: a command is not finite, out of range or of another shape; no step was taken.
            OutputError: the recording cannot be written; the steps up to then were taken.
        """
        with self._lock:
            self._take(commands, released, device, contrast)
            status = lib.sel_simulator_repeat(self.handle, self._hand, n)
            if status:
                self._context.check(status)

    def _take(self, commands: Optional[ArrayLike], released: Optional[Sequence[bool]], device: Optional[Sequence[int]], contrast: tuple[float, int]) -> None:
        if commands is None:
            self._rates[:] = 0
        else:
            given = np.asarray(commands, dtype=np.float64)
            if given.shape != self._rates.shape and not (given.shape == (2,) and len(self.tools) == 1):
                raise ArgumentError(f"commands have the shape {given.shape}; expected {self._rates.shape}: push [mm/s] and twist [deg/s] of {', '.join(self.tools)}")
            self._rates[:] = given
        self._holds[:, 0] = 0 if released is None else released
        self._holds[:, 1] = 0 if device is None else device
        self._hand.contrast_ml_s, self._hand.contrast_tool = contrast

    def follow(self, n: int = 1) -> None:
        """Makes `n` steps with the commands of the scene's script; still after its end. ``scene.script_s`` is its duration."""
        with self._lock:
            self._context.check(lib.sel_simulator_follow(self.handle, n))

    # --- state ---

    @property
    def tools(self) -> tuple[str, ...]:
        """The names of the tools, the outermost first."""
        return self.scene.tools

    @property
    def steps(self) -> int:
        """Steps so far."""
        return lib.sel_simulator_steps(self.handle)

    @property
    def time_s(self) -> float:
        """Simulated time [s]."""
        return lib.sel_simulator_time_s(self.handle)

    @property
    def state_hash(self) -> str:
        """Hash of the state as 16 digits, bit for bit: equal hashes are equal runs. ``seldinger run --summary`` gives the same."""
        return f"{lib.sel_simulator_hash(self.handle):016x}"

    def table(self, tool: int = 0) -> NDArray[np.void]:
        """The nodes of a tool, proximal to distal, as a structured array (n,) of type ``NODE``. The library writes them into one array for
        each tool, which the first call after a step overwrites: keep a ``.copy()``."""
        with self._lock:
            nodes = self._table.get(tool)
            if nodes is None:
                nodes = self._table[tool] = _Nodes(self, tool)
            return nodes.read(self)

    def nodes(self, tool: int = 0) -> Floats:
        """Positions of a tool's nodes, (n, 3) mm, proximal to distal: a view of ``table``, without a copy."""
        return self.table(tool)["position_mm"]

    def orientations(self, tool: int = 0) -> Floats:
        """Quaternions of a tool's nodes, (n, 4), w, x, y, z: the tool's frame in space, x towards the tip. A view of ``table``."""
        return self.table(tool)["quaternion"]

    @property
    def centreline(self) -> Floats:
        """The centreline that all tools share, from the sheath to the foremost tip, (n, 3) mm: a read-only view of the simulator's own state,
        which every step changes. With several tools n changes too: ask again after a step."""
        return self._state_rows(3)

    @property
    def centreline_orientations(self) -> Floats:
        """The quaternions of ``centreline``, (n, 4), w, x, y, z; read-only, as there."""
        return self._state_rows(4)

    def _state_rows(self, columns: int) -> Floats:
        pointer, count = ffi.new("const double **"), ffi.new("int *")
        position, quaternion = (pointer, ffi.NULL) if columns == 3 else (ffi.NULL, pointer)
        self._context.check(lib.sel_simulator_centreline(self.handle, position, quaternion, count))
        # the buffer keeps the simulator alive
        rows = np.frombuffer(_Owned(self.handle, pointer[0], 8 * columns * count[0]).buffer, np.float64).reshape(-1, columns)
        rows.flags.writeable = False
        return rows

    @property
    def tip(self) -> Floats:
        """The tip of the last tool, the innermost, (3,) mm."""
        return self.tip_of(len(self.tools) - 1)

    def tip_of(self, tool: int) -> Floats:
        """The tip of a tool, (3,) mm."""
        tip = np.empty(3)
        with self._lock:
            self._context.check(lib.sel_simulator_tip(self.handle, tool, ffi.from_buffer("double *", tip)))
        return tip

    # --- forces ---

    @property
    def report(self) -> Any:
        """The figures of the last step: a C structure with the fields of ``SelReport`` (include/seldinger/simulator.h)."""
        steps = self.steps
        if self._reported != steps:
            lib.sel_simulator_report(self.handle, self._report, ffi.sizeof("SelReport"))
            self._reported = steps
        return self._report

    def _of_tools(self, values: Any) -> Floats:
        return np.array(list(values)[:len(self.tools)])

    @property
    def hand_force(self) -> Floats:
        """Force at each tool's hand, (tools,) N, positive when it pushes against resistance."""
        return self._of_tools(self.report.push_n)

    @property
    def hand_torque(self) -> Floats:
        """Torque at each tool's hand, (tools,) N mm."""
        return self._of_tools(self.report.torque_n_mm)

    @property
    def inserted(self) -> Floats:
        """Length of each tool beyond the sheath, (tools,) mm."""
        return self._of_tools(self.report.inserted_mm)

    @property
    def turned(self) -> Floats:
        """Turned by each hand since the start, (tools,) deg."""
        return self._of_tools(self.report.turned_deg)

    @property
    def wall_force(self) -> float:
        """Sum of the magnitudes of the wall's forces [N]."""
        return self.report.wall_force_sum_n

    @property
    def wall_force_max(self) -> float:
        """The largest contact force [N]."""
        return self.report.wall_force_max_n

    @property
    def penetration(self) -> float:
        """The deepest penetration of the wall [mm], >= 0."""
        return self.report.penetration_mm

    @property
    def flags(self) -> Flag:
        """What the last step reports."""
        return Flag(self.report.flags)

    @property
    def flags_ever(self) -> Flag:
        """What any step so far reported."""
        return Flag(self.report.flags_ever)

    @property
    def contacts(self) -> NDArray[np.void]:
        """The places where the wall presses, a structured array (n,) of type ``CONTACT``. Queries the vessel again, about 20 us."""
        count = ffi.new("int *")
        with self._lock:
            contacts = np.zeros(64, CONTACT)
            while True:
                self._context.check(lib.sel_simulator_contacts(self.handle, ffi.from_buffer("SelContact *", contacts), len(contacts), count))
                if count[0] <= len(contacts):
                    return contacts[:count[0]]
                contacts = np.zeros(count[0], CONTACT)

    # --- targets and score ---

    @property
    def targets(self) -> tuple[Target, ...]:
        """The scene's targets: name, point (3,) mm, radius [mm]."""
        return self.scene.targets

    def reach(self, target: int = 0) -> tuple[float, float, bool]:
        """How close the foremost tip came to a target: the least distance so far [mm], its time [s], and whether it was reached."""
        reach = ffi.new("SelTargetReach *")
        if lib.sel_simulator_target(self.handle, target, reach) != lib.SEL_OK:
            raise ArgumentError(f"there is no target {target}; the scene has {len(self.targets)}")
        return reach.distance_mm, reach.time_s, bool(reach.is_reached)

    def score(self) -> dict[str, Any]:
        """The figures that an exercise judges: ``state`` ("waiting", "running", "reached", "time_out"), ``points`` (0 to 100), ``time_s``,
        ``path_mm``, ``way_mm``, ``remaining_mm``, ``inserted_mm``, ``withdrawn_mm``, ``wall_force_peak_n``, ``wall_impulse_n_s``,
        ``tip_force_peak_n``, ``contrast_ml``, ``errors``.

        Raises:
            StateError: the simulator keeps no score.
        """
        score = ffi.new("SelScore *")
        self._context.check(lib.sel_simulator_score(self.handle, score, ffi.sizeof("SelScore")))
        figures = {name: getattr(score, name) for name, _ in ffi.typeof("SelScore").fields if name not in ("size", "state")}
        return {"state": ("waiting", "running", "reached", "time_out")[score.state], **figures}

    def score_details(self) -> dict[str, Any]:
        """All figures, as ``seldinger run --score`` writes them."""
        text = ffi.new("char **")
        with self._lock:
            self._context.check(lib.sel_simulator_score_json(self.handle, text))
        try:
            return json.loads(text_of(text[0]))
        finally:
            lib.sel_free(text[0])

    # --- pictures ---

    def image(self, lao_deg: float = 0.0, cran_deg: float = 0.0, size: int = 256, *, field_mm: float = 0.0, centre: Optional[ArrayLike] = None,
              contrast: float = 0.3, out: Optional[NDArray[np.uint8]] = None) -> NDArray[np.uint8]:
        """A plain X-ray picture of vessels and tools: transmission without anatomy and noise.

        Args:
            lao_deg: the C-arm to the patient's left, -90 to 90.
            cran_deg: towards the head, -45 to 45.
            size: side of the picture in pixels, 8 to 4096.
            field_mm: side of the square seen at the isocentre, 40 to 400; 0: all vessels are seen.
            centre: the isocentre, (3,) mm; None: the middle of the vessels.
            contrast: contrast agent in all vessels, 0 to 1 (undiluted).
            out: (size, size) uint8, to be overwritten and returned; None: a new array.

        Returns:
            (size, size) uint8, the top row first: 255 exp(-attenuation).
        """
        options = ffi.new("SelImageOptions *")
        lib.sel_image_options_init(options, ffi.sizeof("SelImageOptions"))
        options.lao_deg, options.cra_deg, options.field_mm, options.contrast, options.pixels = lao_deg, cran_deg, field_mm, contrast, size
        if centre is not None:
            options.has_centre, options.centre_mm = 1, np.asarray(centre, np.float64).reshape(3).tolist()
        if out is None:
            out = np.empty((max(size, 0), max(size, 0)), np.uint8)
        elif out.shape != (size, size) or out.dtype != np.uint8 or not out.flags.c_contiguous:
            raise ArgumentError(f"out is {out.dtype} of shape {out.shape}; expected a contiguous array of uint8, shape {(size, size)}")
        with self._lock:
            self._context.check(lib.sel_simulator_image(self.handle, options, ffi.from_buffer("unsigned char *", out)))
        return out

    # --- recording ---

    @property
    def is_recording(self) -> bool:
        """Whether a recording runs."""
        return self._is_recording

    def record(self, path: PathLike, *, frame_ms: float = 10.0, expected_s: float = 0.0) -> None:
        """Records all steps from now on to an HDF5 file, which ``Recording`` and ``seldinger replay`` read, also after a kill.

        Args:
            path: of the file.
            frame_ms: simulated time between frames with all nodes.
            expected_s: simulated time that will be recorded; 0: unknown.

        Raises:
            StateError: after the first step (``reset`` first), or a recording runs.
            OutputError: the file cannot be written.
        """
        options = ffi.new("SelRecordingOptions *")
        lib.sel_recording_options_init(options, ffi.sizeof("SelRecordingOptions"))
        options.frame_ms, options.expected_s = frame_ms, expected_s
        with self._lock, file_lock:
            self._context.check(lib.sel_simulator_record(self.handle, path_bytes(path), options))
        self._is_recording = True

    def end_recording(self) -> None:
        """Writes the remaining data and closes the recording.

        Raises:
            StateError: nothing is recorded.
            OutputError: the file could not be written.
        """
        self._is_recording = False
        with self._lock, file_lock:
            self._context.check(lib.sel_simulator_end_recording(self.handle))


class _Nodes:
    """The array of a tool's nodes, and the step that it shows."""

    def __init__(self, simulator: Simulator, tool: int) -> None:
        capacity = lib.sel_simulator_node_capacity(simulator.handle, tool)
        if capacity == 0:
            raise ArgumentError(f"there is no tool {tool}; the tools are 0 to {len(simulator.tools) - 1}: {', '.join(simulator.tools)}")
        self.tool, self.steps, self.count = tool, -1, ffi.new("int *")
        self.array = np.zeros(capacity, NODE)
        self.pointer = ffi.from_buffer("SelNode *", self.array)

    def read(self, simulator: Simulator) -> NDArray[np.void]:
        steps = simulator.steps
        if self.steps != steps:
            simulator._context.check(lib.sel_simulator_nodes(simulator.handle, self.tool, self.pointer, len(self.array), self.count))
            self.steps = steps
        return self.array[:self.count[0]]


class _Owned:
    """Memory of a handle, which lives as long as an array over it."""

    def __init__(self, handle: Any, pointer: Any, size: int) -> None:
        self.buffer = ffi.buffer(ffi.gc(ffi.cast("char *", pointer), lambda _: handle), size)
