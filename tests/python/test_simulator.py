"""The simulator from Python: the same states as the program, arrays without copies, faults as exceptions."""
import os
import tempfile
import threading
import unittest

import numpy as np

import seldinger

PHANTOM = "scenes/phantom/scene.yaml"
PHANTOM_HASH = "692e8186b7da73ab"        # of `seldinger run` on the same scene, over the script

TUBE = {"vessel": {"tube": {"start_mm": [0, 0, 0], "direction": [1, 0, 0], "normal": [0, 1, 0], "radius_mm": 2.0, "path": [{"line_mm": 60}]}, "contact": "tube",
                   "friction": 0.1},
        "wire": {"elements": 40, "sections": [{"length_mm": 60, "diameter_mm": 0.36, "young_modulus_gpa": 20, "poisson_ratio": 0.3, "density_g_cm3": 6.45}]},
        "sheath": {"inlet": "root", "inserted_mm": 5},
        "targets": [{"name": "end", "point_mm": [40, 0, 0], "radius_mm": 1}]}


class Steps(unittest.TestCase):
    def test_states_are_the_programs(self):
        sim = seldinger.Simulator(PHANTOM)
        sim.follow(round(sim.scene.script_s / sim.scene.step_s))
        self.assertEqual(sim.state_hash, PHANTOM_HASH)

    def test_two_tools_take_less_than_3_mb(self):
        def resident_mb():
            with open("/proc/self/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
        scene = seldinger.Scene(seldinger.scene_path("steve/dual-device-nav.yaml"))
        first = seldinger.Simulator(scene)
        first.follow(20)
        before = resident_mb()
        many = [seldinger.Simulator(scene) for _ in range(8)]
        for sim in many:
            sim.follow(20)
        self.assertLess((resident_mb() - before) / len(many), 3)
        for sim in many[:2]:                    # the start that they share serves each of them
            sim.reset()
            sim.follow(20)
            self.assertEqual(sim.state_hash, first.state_hash)

    def test_n_steps_are_n_times_one(self):
        a, b = seldinger.Simulator(TUBE), seldinger.Simulator(TUBE)
        a.step([[30, 90]], n=50)
        for _ in range(50):
            b.step([30, 90])
        self.assertEqual(a.state_hash, b.state_hash)
        self.assertAlmostEqual(a.time_s, 0.05)
        self.assertAlmostEqual(a.inserted[0], 6.5, places=6)
        self.assertAlmostEqual(a.turned[0], 4.5, places=6)

    def test_reset_and_clone_repeat_bit_for_bit(self):
        a = seldinger.Simulator(PHANTOM, keeps_score=False)
        a.follow(1500)
        b = a.clone()
        for sim in (a, b):
            sim.step([[20, 180]], n=200)
        self.assertEqual(a.state_hash, b.state_hash)
        self.assertEqual(a.reach(), b.reach())
        a.reset()
        self.assertEqual((a.time_s, a.inserted[0]), (0, seldinger.Simulator(a.scene).inserted[0]))
        a.follow(1500)
        a.step([[20, 180]], n=200)
        self.assertEqual(a.state_hash, b.state_hash)

    def test_reset_begins_the_score_again(self):
        sim = seldinger.Simulator(PHANTOM)
        sim.step([[20, 0]], n=100)
        first = sim.score()
        sim.reset()
        self.assertEqual((sim.score()["state"], sim.score()["path_mm"]), ("waiting", 0))
        sim.step([[20, 0]], n=100)
        self.assertEqual(sim.score(), first)
        self.assertEqual(sim.score_details()["state"], "running")

    def test_threads_give_the_same_bits(self):
        scene = seldinger.Scene(PHANTOM)
        hashes = {}

        def run(k):
            sim = seldinger.Simulator(scene)
            sim.follow(400)
            hashes[k] = sim.state_hash

        threads = [threading.Thread(target=run, args=(k,)) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(set(hashes.values())), 1)


class Arrays(unittest.TestCase):
    def test_nodes_are_views(self):
        sim = seldinger.Simulator(PHANTOM)
        nodes, live = sim.nodes(), sim.centreline
        before = nodes.copy()
        self.assertEqual((nodes.shape, sim.orientations().shape, live.shape), ((201, 3), (201, 4), (201, 3)))
        sim.step([[20, 0]], n=100)
        self.assertTrue(np.array_equal(nodes, before))
        self.assertTrue(np.array_equal(sim.nodes(), live))       # the state itself has moved on
        self.assertFalse(np.array_equal(nodes, before))          # and `nodes` is the same memory
        self.assertTrue(np.shares_memory(sim.nodes(), nodes))
        self.assertTrue(np.array_equal(sim.tip, live[-1]))
        with self.assertRaises(ValueError):
            live[0, 0] = 1

    def test_live_rows_outlive_the_simulator(self):
        sim = seldinger.Simulator(TUBE)
        live = sim.centreline
        tip = sim.tip
        del sim
        self.assertTrue(np.array_equal(live[-1], tip))

    def test_frames_are_rotations_along_the_tool(self):
        sim = seldinger.Simulator(PHANTOM)
        sim.follow(3000)
        w, x, y, z = sim.orientations().T
        self.assertLess(np.abs(w * w + x * x + y * y + z * z - 1).max(), 1e-12)
        along = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
        chords = np.diff(sim.nodes(), axis=0)
        chords /= np.linalg.norm(chords, axis=1)[:, None]
        self.assertGreater((along[1:-1] * (chords[1:] + chords[:-1]) / 2).sum(axis=1).min(), 0.95)

    def test_forces_balance(self):
        """At rest the wall's force along the sheath is the hand's push and the force M^2 / (2 E I) by which a frictionless sleeve drives out
        a rod that bends at its mouth (Bigoni, Dal Corso, Bosi, Misseroni: Eshelby-like forces acting on elastic structures, 2015)."""
        bend = {**TUBE, "vessel": {**TUBE["vessel"], "tube": {**TUBE["vessel"]["tube"],
                                                              "path": [{"line_mm": 10}, {"arc": {"radius_mm": 15, "angle_deg": 120}}, {"line_mm": 30}]}}}
        sim = seldinger.Simulator(bend)
        sim.step([[40, 0]], n=1000)
        sim.step(None, n=2000)
        contacts, (mouth, direction) = sim.contacts, sim.scene.entry
        self.assertGreater(len(contacts), 2)
        along = -contacts["force_n"].sum(axis=0) @ direction
        moment = np.cross(contacts["position_mm"] - mouth, contacts["force_n"]).sum(axis=0)
        sleeve = moment @ moment / (2 * 20000 * np.pi * 0.36**4 / 64)
        self.assertGreater(sleeve, 1e-3 * along)             # without it the balance would be wrong by that
        self.assertLess(abs(along - sleeve - sim.hand_force[0]), 1e-4 * along)

    def test_query(self):
        scene = seldinger.Scene(TUBE)
        gap, normal = scene.query([[30, 0, 0], [30, 1.5, 0], [30, 0, -3]])
        self.assertLess(np.abs(gap - [2, 0.5, -1]).max(), 1e-12)
        self.assertLess(np.abs(normal[1:] - [[0, -1, 0], [0, 0, 1]]).max(), 1e-12)
        self.assertEqual([(t.name, t.radius, list(t.point)) for t in scene.targets], [("end", 1.0, [40.0, 0.0, 0.0])])


class Pictures(unittest.TestCase):
    def test_attenuation_is_the_tools_volume(self):
        """The sum over the picture is the tool's volume beyond the sheath times its attenuation, whatever the resolution and the angle."""
        sim = seldinger.Simulator(TUBE)
        sim.step([[50, 0]], n=500)                          # 30 mm inserted, straight, of which 3 are the marker
        volume = np.pi / 4 * 0.36**2 * 30
        for size, lao in ((128, 0), (512, 0), (256, 40)):
            picture = sim.image(lao, 0, size, field_mm=100, centre=[0, 0, 0], contrast=0).astype(float)
            area = (100 / size)**2
            attenuation = -np.log(picture / 255)
            got = attenuation[attenuation > 0.02].sum() * area
            expected = np.pi / 4 * 0.36**2 * (27 * 0.55 + 3 * 1.2)
            # the picture has steps of 1/255, and depth shows the pixels' area up to 3 % smaller or larger
            self.assertLess(abs(got / expected - 1), 0.08, (size, lao, got, expected, volume))

    def test_tools_and_vessels_lie_where_they_are_projected(self):
        sim = seldinger.Simulator(PHANTOM)
        sim.follow(2000)
        size, field, centre = 400, 100.0, np.array([0.0, 0.0, 30.0])
        bare = sim.image(0, 0, size, field_mm=field, centre=centre, contrast=0)
        x, y, z = (sim.tip - centre)                        # to the patient's right, to the front, to the head, as the scene says; seen from the front
        x, scale = -x, 785.0 / ((785.0 + y) * field)
        column, row = (x * scale + 0.5) * size - 0.5, (0.5 - z * scale) * size - 0.5
        rows, columns = np.nonzero(bare < 255)
        self.assertLess(np.hypot(rows - row, columns - column).min(), 2)
        self.assertLess(abs(rows.min() - row) if z > 20 else 0, 3)
        self.assertTrue((sim.image(0, 0, size, field_mm=field, centre=centre) <= bare).all())
        self.assertEqual(sim.image(30, -20, 64).shape, (64, 64))
        with self.assertRaisesRegex(seldinger.ArgumentError, "lao_deg is not within"):
            sim.image(100)
        with self.assertRaisesRegex(seldinger.ArgumentError, "expected a contiguous array"):
            sim.image(0, 0, 64, out=np.zeros((3, 3), np.uint8))


class Recordings(unittest.TestCase):
    def test_a_recording_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "run.h5")
            with seldinger.Simulator(TUBE, record=path) as sim:
                sim.step([[20, 0]], n=20)
            self.assertGreater(os.path.getsize(path), 1000)
            with self.assertRaisesRegex(seldinger.OutputError, "no/such"):
                seldinger.Simulator(TUBE, record=folder + "/no/such/run.h5")


class Faults(unittest.TestCase):
    def test_all_faults_of_a_scene(self):
        with self.assertRaises(seldinger.InputError) as caught:
            seldinger.Scene({"wire": {"elements": -3}, "x": 1})
        self.assertGreaterEqual(len(caught.exception.faults), 3)
        self.assertIn("unknown key 'x' in 'scene'; expected seldinger, vessel", str(caught.exception))

    def test_wrong_calls(self):
        sim = seldinger.Simulator(TUBE, keeps_score=False)
        wrong = [(seldinger.ArgumentError, "expected \\(1, 2\\)", lambda: sim.step([1, 2, 3])),
                 (seldinger.ArgumentError, "push_mm_s is not within -1000 to 1000", lambda: sim.step([[1e9, 0]])),
                 (seldinger.ArgumentError, "twist_deg_s is not within", lambda: sim.step([[0, float("nan")]])),
                 (seldinger.ArgumentError, "count is negative", lambda: sim.step(n=-1)),
                 (seldinger.ArgumentError, "the tools are 0 to 0: wire", lambda: sim.nodes(1)),
                 (seldinger.ArgumentError, "no target 7", lambda: sim.reach(7)),
                 (seldinger.StateError, "without a score", sim.score),
                 (seldinger.StateError, "nothing is recorded", sim.end_recording),
                 (seldinger.InputError, "nope.yaml: cannot be opened", lambda: seldinger.Scene("nope.yaml")),
                 (TypeError, "a scene cannot hold a object", lambda: seldinger.Scene({"wire": object()}))]
        for error, words, call in wrong:
            with self.assertRaisesRegex(error, words):
                call()
        self.assertEqual(sim.steps, 0)
        with self.assertRaises(ValueError):      # ours are Python's too
            sim.step([[1e9, 0]])
        sim.close()
        with self.assertRaisesRegex(seldinger.StateError, "closed"):
            sim.step()


if __name__ == "__main__":
    unittest.main()
