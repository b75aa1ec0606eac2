"""A batch: the states of single simulators, whatever the number of threads."""
import multiprocessing
import unittest

import numpy as np

import seldinger
from test_simulator import PHANTOM, TUBE


def hashes_of(batch, rates, steps):
    batch.wants_hashes()
    for rate in rates:
        batch.step(rate, n=steps)
    return batch.hashes.copy()


class Batches(unittest.TestCase):
    def test_states_do_not_depend_on_threads(self):
        scene = seldinger.Scene(PHANTOM)
        rng = np.random.default_rng(7)
        rates = rng.uniform([0, -200], [40, 200], (6, 9, 1, 2))
        got = [hashes_of(seldinger.Batch(scene, 9, threads=threads), rates, 40) for threads in (1, 2, 3, 8, 0)]
        for other in got[1:]:
            self.assertTrue(np.array_equal(got[0], other))
        self.assertEqual(len(set(got[0])), 9)
        for k in (0, 8):
            sim = seldinger.Simulator(scene)
            for rate in rates:
                sim.step(rate[k], n=40)
            self.assertEqual(f"{got[0][k]:016x}", sim.state_hash)

    def test_rows_are_the_simulators(self):
        batch = seldinger.Batch([TUBE, PHANTOM, TUBE])
        tips = batch.tips
        batch.step([[20, 90]], n=100)
        batch.step([[20, 90]], n=100, skip=[False, True, False])
        self.assertTrue(np.allclose(batch.time_s, [0.2, 0.1, 0.2]))
        for k in range(3):
            sim = batch.simulator(k)
            self.assertTrue(np.array_equal(tips[k], sim.tip))
            self.assertEqual(batch.hand_force[k, 0], sim.hand_force[0])
            self.assertEqual(batch.inserted[k, 0], sim.inserted[0])
            self.assertEqual(batch.rows["penetration_mm"][k], sim.penetration)
            self.assertAlmostEqual(batch.target_distance[k], np.linalg.norm(sim.tip - sim.targets[0].point), places=12)
        batch.reset(1)
        self.assertEqual(list(batch.time_s), [0.2, 0, 0.2])
        batch.commands[1, 0] = 30, 0
        batch.step()
        self.assertAlmostEqual(batch.time_s[1], 0.001)
        self.assertAlmostEqual(batch.inserted[1, 0], seldinger.Simulator(PHANTOM).inserted[0] + 0.03, places=9)

    def test_rows_outlive_the_batch(self):
        batch = seldinger.Batch(TUBE, 3)
        batch.step([[20, 0]], n=5)
        tips, sim, before = batch.tips, batch.simulator(1), batch.tips.copy()
        del batch
        self.assertTrue(np.array_equal(tips, before))
        self.assertTrue(np.array_equal(sim.tip, before[1]))

    def test_wrong_calls(self):
        batch = seldinger.Batch(TUBE, 3)
        wrong = [("simulator 1: push_mm_s is not within", lambda: batch.step([[[0, 0]], [[5000, 0]], [[0, 0]]])),
                 ("expected \\(3, tools, 2\\)", lambda: batch.step(np.zeros((4, 1, 2)))),
                 ("expected \\(3, tools, 2\\)", lambda: batch.step(np.zeros((9, 2)))),
                 ("expected \\(3,\\)", lambda: batch.step([[0, 0]], skip=[0])),
                 ("steps is negative", lambda: batch.step([[0, 0]], n=-1)),
                 ("they are 0 to 2", lambda: batch.simulator(3)),
                 ("count is not within", lambda: seldinger.Batch(TUBE, 0)),
                 ("count is not given", lambda: seldinger.Batch(TUBE)),
                 ("threads is not within", lambda: seldinger.Batch(TUBE, 2, threads=1000))]
        for words, call in wrong:
            with self.assertRaisesRegex(seldinger.ArgumentError, words):
                call()
        self.assertTrue((batch.time_s == 0).all())

    def test_a_forked_child_steps_alone(self):
        batch = seldinger.Batch(TUBE, 4, threads=3)
        batch.wants_hashes()

        def child(queue):
            batch.step([[20, 0]], n=20)
            queue.put(batch.hashes.tolist())

        fork = multiprocessing.get_context("fork")
        queue = fork.Queue()
        process = fork.Process(target=child, args=(queue,))
        process.start()
        got = queue.get(timeout=60)
        process.join()
        batch.step([[20, 0]], n=20)
        self.assertEqual(got, batch.hashes.tolist())


if __name__ == "__main__":
    unittest.main()
