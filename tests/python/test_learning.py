"""The learning example, in short: it improves within a small budget, and its result does not depend on threads."""
import importlib.util
import unittest

import numpy as np

spec = importlib.util.spec_from_file_location("learn_aneurysm", "python/examples/learn_aneurysm.py")
example = importlib.util.module_from_spec(spec)
spec.loader.exec_module(example)


class Learning(unittest.TestCase):
    def test_it_improves(self):
        learned = example.learn(generations=3, hands=20, starts=1, seed=1)          # the example's own first generations
        means = learned.rewards.mean(axis=1)
        self.assertTrue(means[0] < means[1] < means[2], means)
        self.assertGreater(means[2], means[0] + 0.05)

    def test_threads_do_not_matter(self):
        one, two = (example.learn(generations=1, hands=3, starts=1, seed=2, threads=threads) for threads in (1, 2))
        for a, b in zip(one, two):
            self.assertTrue(np.array_equal(a, b))


if __name__ == "__main__":
    unittest.main()
