"""Seldinger: guide wires and catheters in blood vessels, in real time. A tool for training and research, not a medical device.

Lengths mm, time s, force N, torque N mm, angles deg, speed mm/s and deg/s. Arrays are numpy's, float64; tools are counted from 0, the
outermost first.

    import seldinger
    sim = seldinger.Simulator(seldinger.scene_path("phantom/scene.yaml"))
    sim.step([[20, 0]], n=500)
    print(sim.time_s, sim.tip, sim.hand_force)
"""
from ._library import ArgumentError, Error, InputError, LibraryMemoryError, OutputError, StateError, version
from .batch import ROW, Batch
from .recon import TREE_NODE, DoubtWarning, Tree, Volume
from .recording import Recording
from .scene import Scene, Target, scene_path
from .simulator import CONTACT, NODE, Flag, Simulator

__version__ = version()
__all__ = ["ArgumentError", "Batch", "CONTACT", "DoubtWarning", "Error", "Flag", "InputError", "LibraryMemoryError", "NODE", "OutputError", "ROW", "Recording", "Scene", "Simulator",
           "StateError", "TREE_NODE", "Target", "Tree", "Volume", "scene_path", "version"]
