"""Volumes, trees, models and recordings as arrays."""
import os
import shutil
import subprocess
import tempfile
import time
import unittest

import numpy as np

import seldinger
from test_simulator import TUBE

RADIUS, LENGTH, VOXEL = 2.0, 30.0, 0.5


def tube_volume():
    """A straight vessel along z, bright, with the edge of a voxel."""
    x = np.arange(-8, 8.01, VOXEL)
    z = np.arange(0, LENGTH + 0.01, VOXEL)
    r = np.hypot(x[:, None], x[None, :])
    disc = np.clip((RADIUS - r) / VOXEL + 0.5, 0, 1)
    noise = np.random.default_rng(1).normal(0, 10, (len(x), len(x), len(z)))
    return seldinger.Volume((1000 * disc[:, :, None] + noise).astype(np.float32), origin=(-8, -8, 0), spacing=(VOXEL, VOXEL, VOXEL))


class Reconstructions(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.volume = tube_volume()
        cls.progress = []
        cls.tree = cls.volume.segment((0, 0, 15))
        cls.model = cls.tree.fit(progress=lambda done, total: cls.progress.append((done, total)))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_a_volume_becomes_a_wall(self):
        self.assertEqual((self.volume.shape, self.volume.voxel_mm), ((33, 33, 61), VOXEL))
        nodes, points = self.tree.nodes, self.tree.points
        self.assertGreater(len(nodes), 5)
        self.assertTrue((nodes["parent"] < np.arange(len(nodes))).all())
        self.assertLess(np.abs(nodes["radius_mm"] - RADIUS).max(), 0.3)
        inner = np.abs(points[:, 2] - LENGTH / 2) < 10
        self.assertLess(np.abs(np.hypot(points[inner, 0], points[inner, 1]) - RADIUS).mean(), 0.1)
        self.assertTrue(self.model.is_model and not self.tree.is_model)
        self.assertTrue(self.progress and self.progress[-1][0] == self.progress[-1][1])
        angle = np.linspace(0, 6, 7)
        probe = np.stack([1.5 * np.cos(angle), 1.5 * np.sin(angle), 0 * angle + 15], axis=1)
        gap, normal = self.model.query(probe)
        self.assertLess(np.abs(gap - (RADIUS - 1.5)).max(), 0.1)
        self.assertLess((normal * probe).sum(axis=1).max(), 0)
        with self.assertRaisesRegex(seldinger.StateError, "no wall"):
            self.tree.query(probe)
        with self.assertRaisesRegex(seldinger.InputError, "start"):
            self.volume.segment((7, 7, 15))
        with self.assertRaisesRegex(seldinger.ArgumentError, "expected \\(nx, ny, nz\\)"):
            seldinger.Volume(np.zeros((3, 3)))

    def test_a_model_is_a_scenes_vessel_until_it_changes(self):
        path = os.path.join(self.folder, "model.h5")
        self.model.save(path)
        scene = {**TUBE, "vessel": {"model": path}, "sheath": {"entry_mm": [0, 0, 3], "direction": [0, 0, 1], "inserted_mm": 2}}
        first = seldinger.Scene(scene)
        start = time.process_time()
        again = seldinger.Scene(scene)
        self.assertLess(time.process_time() - start, 0.05)               # the vessel is shared
        self.assertEqual(first.query([[0, 0, 15]])[0][0], again.query([[0, 0, 15]])[0][0])
        self.assertLess(abs(first.query([[0, 0, 15]])[0][0] - RADIUS), 0.1)
        sim = seldinger.Simulator(scene)
        sim.step([[40, 0]], n=200)
        self.assertLess(abs(sim.inserted[0] - 10), 1e-6)
        moved = seldinger.Volume(np.full((4, 4, 4), 1.0))                # a file that changes is read again
        self.assertEqual(moved.shape, (4, 4, 4))
        time.sleep(0.01)
        self.tree.save(path)
        with self.assertRaisesRegex(seldinger.InputError, "without a model"):
            seldinger.Scene(scene)

    def test_a_surface_becomes_a_tree(self):
        path = os.path.join(self.folder, "tube.stl")
        program = os.environ.get("SELDINGER_PROGRAM", "build/ci/seldinger")
        model = os.path.join(self.folder, "for-export.h5")
        self.model.save(model)
        subprocess.run([program, "export", model, "-o", path], check=True, capture_output=True)
        tree = seldinger.Tree.from_surface(path)
        self.assertLess(abs(np.median(tree.nodes["radius_mm"]) - RADIUS), 0.15)
        copy = os.path.join(self.folder, "copy.h5")
        tree.save(copy)
        self.assertTrue(np.array_equal(seldinger.Tree(copy).points, tree.points))
        with self.assertRaisesRegex(seldinger.InputError, "missing.stl"):
            seldinger.Tree.from_surface(self.folder + "/missing.stl")


class Recordings(unittest.TestCase):
    def test_arrays_are_what_was_done(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "run.h5")
            with seldinger.Simulator(TUBE, record=path) as sim:
                sim.step([[20, 90]], n=60)
                sim.step([[-10, 0]], n=40)
                last, push, line = int(sim.state_hash, 16), sim.hand_force[0], sim.centreline.copy()
            run = seldinger.Recording(path)
            self.assertEqual((len(run), run.step_s), (100, 0.001))
            self.assertTrue((run.commands[:60, 0] == [20, 90]).all() and (run.commands[60:, 0] == [-10, 0]).all())
            self.assertEqual((run.hashes[-1], run.push[-1, 0]), (last, push))
            self.assertEqual(run.time_s[-1], 0.1)
            self.assertEqual(run.frame_steps[-1], 99)                # counted from 0
            self.assertLess(np.abs(run.frames[-1] - line).max(), 1e-3)
            self.assertIsNone(run.verify())
            softer = {**TUBE, "wire": {"elements": 40, "sections": [{**TUBE["wire"]["sections"][0], "young_modulus_gpa": 10}]}}
            self.assertEqual(run.verify(seldinger.Scene(softer)), 0)
            with self.assertRaisesRegex(seldinger.InputError, "nothing.h5"):
                seldinger.Recording(folder + "/nothing.h5")


if __name__ == "__main__":
    unittest.main()
