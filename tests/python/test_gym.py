"""seldinger.gym: Gymnasium's contract, the same bits from the same seed, rewards that add up to the score, faults, and the vectorised form."""
import tempfile
import unittest

import numpy as np

import seldinger
from seldinger.gym import Navigation, Start, VectorNavigation, check_environment, has_gymnasium
from seldinger.gym import spaces

TUBE = {"vessel": {"tube": {"start_mm": [0, 0, 0], "direction": [0, 0, 1], "normal": [0, -1, 0], "radius_mm": 2.0,
                            "path": [{"line_mm": 20}, {"arc": {"radius_mm": 20, "angle_deg": 60}}, {"line_mm": 20}]}, "contact": "tube", "friction": 0.1},
        "wire": {"elements": 30, "sections": [{"length_mm": 60, "diameter_mm": 0.36, "young_modulus_gpa": 5, "poisson_ratio": 0.3, "density_g_cm3": 6.45}],
                 "damping": {"mass_1_s": 0.5, "stiffness_s": 0.0002}},
        "sheath": {"inlet": "root", "inserted_mm": 5},
        "fluoroscopy": {"anterior": [0, -1, 0], "superior": [0, 0, 1], "lao_deg": 30, "cra_deg": 10},
        "targets": [{"name": "bend", "point_mm": [0, -2, 28], "radius_mm": 4}]}
ARCH = "scenes/steve/basic-wire-nav.yaml"
EXERCISE = "scenes/exercises/aneurysm.yaml"
ALL = ("tip", "shaft", "target", "inserted", "turned", "force")


def tube(**options):
    return Navigation(TUBE, **{"reward": "steve", "commands": 30, **options})


class Contract(unittest.TestCase):
    def test_environments_keep_it(self):
        for options in ({}, {"observe": ("image", "tip"), "render_mode": "rgb_array", "image_size": 32},
                        {"start": Start(inserted_mm=(0, 3), turned_deg=(-90, 90), push_gain=(0.8, 1.2))}):
            with self.subTest(options), tube(**options) as env:
                check_environment(env)

    def test_the_package_agrees(self):
        if not has_gymnasium:
            self.skipTest("gymnasium is not installed")
        from gymnasium.utils.env_checker import check_env
        check_env(tube(), skip_render_check=True)

    def test_the_checker_finds_what_is_broken(self):
        class Forgets(Navigation):              # a seed that does nothing
            def reset(self, *, seed=None, options=None):
                return super().reset(options=options)

        class Overwrites(Navigation):           # one array for all observations
            def judge(self):
                observation, *rest = super().judge()
                self.kept = getattr(self, "kept", observation)
                for key in observation:
                    self.kept[key][...] = observation[key]
                return (self.kept, *rest)

        class Strays(Navigation):               # an observation outside the space
            def judge(self):
                observation, *rest = super().judge()
                return (dict(observation, tip=observation["tip"] + 5000), *rest)

        class Old(Navigation):                  # four results, as before 0.26
            def step(self, action):
                return super().step(action)[:4]
        for broken, words in ((Forgets, "same seed|differ"), (Overwrites, "overwrites"), (Strays, "not in observation_space"), (Old, "does not return")):
            with self.subTest(broken.__name__), self.assertRaisesRegex(AssertionError, words):
                check_environment(broken(TUBE, reward="steve", start=Start(inserted_mm=(0, 5))))

    def test_before_and_after_an_episode(self):
        env = tube(commands=2)
        with self.assertRaisesRegex(seldinger.StateError, "reset"):
            env.step([[1, 0]])
        env.reset(seed=1)
        env.step([[1, 0]])
        _, _, terminated, truncated, info = env.step([[1, 0]])
        self.assertEqual((terminated, truncated, info["success"]), (False, True, False))
        with self.assertRaisesRegex(seldinger.StateError, "reset"):
            env.step([[1, 0]])
        env.close()
        env.close()

    def test_faults_say_what_is_valid(self):
        for options, words in (({"observe": ("tips",)}, "tip, shaft"), ({"reward": "score"}, "exercise"), ({"render_mode": "human"}, "rgb_array"),
                               ({"reward": "points"}, "score or steve"), ({"commands": 0}, "at least 1")):
            with self.subTest(options), self.assertRaisesRegex(seldinger.ArgumentError, words):
                tube(**options)
        with self.assertRaisesRegex(seldinger.ArgumentError, "lower one first"):
            Start(inserted_mm=(5, 1))
        env = tube()
        with self.assertRaisesRegex(seldinger.ArgumentError, "unknown options speed"):
            env.reset(options={"speed": 1})
        env.reset(seed=0)
        for action in ([1, 0, 0], [[np.nan, 0]], [[np.inf, 0]]):
            with self.subTest(action), self.assertRaisesRegex(seldinger.ArgumentError, "finite"):
                env.step(action)
        with self.assertRaisesRegex(seldinger.ArgumentError, "target"):
            Navigation({key: value for key, value in TUBE.items() if key != "targets"}, reward="steve")


class Spaces(unittest.TestCase):
    """Our own spaces, also where gymnasium is installed."""

    def test_boxes(self):
        box = spaces.OwnBox([-1, 0], [1, 5], dtype=np.float32)
        self.assertTrue(all(box.contains(box.sample()) for _ in range(200)))
        for x in (np.array([2, 1], np.float32), np.array([0, 1, 2], np.float32), [0, 1], np.array([np.nan, 1], np.float32), np.array([0, 1], np.float64)):
            self.assertNotIn(x, box)
        box.seed(4)
        a = [box.sample() for _ in range(3)]
        box.seed(4)
        self.assertTrue(np.array_equal(a, [box.sample() for _ in range(3)]))
        samples = np.array([spaces.OwnBox(0, 3, (4,), np.uint8, seed=i).sample() for i in range(100)])
        self.assertEqual(set(samples.ravel()), {0, 1, 2, 3})
        with self.assertRaisesRegex(ValueError, "empty"):
            spaces.OwnBox(1, 0, (2,))

    def test_dictionaries(self):
        both = spaces.OwnDict({"a": spaces.OwnBox(0, 1, (2,)), "b": spaces.OwnBox(0, 1, (2,))}, seed=2)
        sample = both.sample()
        self.assertIn(sample, both)
        self.assertFalse(np.array_equal(sample["a"], sample["b"]))
        self.assertNotIn({"a": sample["a"]}, both)
        both.seed(2)
        self.assertTrue(np.array_equal(both.sample()["b"], sample["b"]))


class Episodes(unittest.TestCase):
    def test_the_same_seed_and_actions_give_the_same_bits(self):
        hashes = []
        for _ in range(2):
            with tube(start=Start(inserted_mm=(0, 5), turned_deg=(-180, 180), push_gain=(0.9, 1.1))) as env:
                for seed in (3, 4, 3):
                    env.reset(seed=seed)
                    env.action_space.seed(seed)
                    for _ in range(5):
                        env.step(env.action_space.sample())
                    hashes.append(env.simulator.state_hash)
        self.assertEqual(hashes[0], hashes[2])         # whatever came before
        self.assertNotEqual(hashes[0], hashes[1])
        self.assertEqual(hashes[:3], hashes[3:])

    def test_a_start_is_where_it_was_asked_for(self):
        env = tube()
        observation, info = env.reset(options={"inserted_mm": 4, "turned_deg": -90})
        self.assertAlmostEqual(float(observation["inserted"][0]), 9, places=4)
        np.testing.assert_allclose(observation["turned"], [[0, -1]], atol=1e-6)
        self.assertEqual(info["start"]["inserted_mm"], 4)
        env.reset(options={"push_gain": 0.5})
        observation, *_ = env.step([[20, 0]])
        self.assertAlmostEqual(float(observation["inserted"][0]), 6, places=4)     # 20 mm/s x 0.1 s x 0.5 beyond 5 mm
        observation, *_ = env.step([[100, 0]])                                     # cut at 35 mm/s
        self.assertAlmostEqual(float(observation["inserted"][0]), 7.75, places=4)

    def test_the_tip_is_where_the_c_arm_sees_it(self):
        # exact: x = D right.p / (D + towards.p) with the axes of LAO 30, CRA 10 written out, D = 785 mm
        env = tube()
        observation, _ = env.reset()
        for _ in range(4):
            observation, *_ = env.step([[20, 0]])
        t, f = np.radians([30, 10])
        p = env.simulator.tip - 0.5 * (env.scene.entry[0] + np.array([0, -2, 28]))
        right = np.array([np.cos(t), np.sin(t), 0])
        level = np.array([np.sin(t), -np.cos(t), 0])
        up, towards = np.cos(f) * np.array([0, 0, 1]) - np.sin(f) * level, np.cos(f) * level + np.sin(f) * np.array([0, 0, 1])
        scale = 785 / (785 + towards @ p)
        np.testing.assert_allclose(observation["tip"][0], [right @ p * scale, up @ p * scale], atol=1e-5)
        behind = np.linalg.norm(observation["shaft"] - observation["tip"][0], axis=1)
        self.assertTrue(np.all(np.diff(behind) > 0) and behind[-1] < 6.1)          # 2, 4, 6 mm behind, shortened by the view

    def test_rewards_add_up(self):
        with Navigation(EXERCISE, push_mm_s=20) as env:
            env.reset(seed=0)
            total, is_over, n = 0.0, False, 0
            while not is_over:
                action = [[0, -90]] if n < 10 else [[20, 0]] if n < 25 else [[8, 0]] if n < 40 else [[0, 0]]       # aneurysm.csv
                _, reward, terminated, truncated, info = env.step(action)
                total, is_over, n = total + reward, terminated or truncated, n + 1
            self.assertTrue(terminated and info["success"])
            self.assertAlmostEqual(total, info["points"] / 100, places=12)
            self.assertGreater(info["points"], 90)

    def test_steves_reward(self):
        env = tube(commands=60)
        _, before = env.reset()
        total, is_over, n = 0.0, False, 0
        while not is_over:
            _, reward, terminated, truncated, info = env.step([[35, 0]])
            total, is_over, n = total + reward, terminated or truncated, n + 1
        self.assertTrue(terminated)
        self.assertAlmostEqual(total, 1 - 0.005 * n + 0.001 * (before["distance_mm"] - info["distance_mm"]), places=9)

    def test_two_tools(self):
        scene = dict(TUBE)
        tool = scene.pop("wire")
        outer = {"elements": 20, "sections": [{"length_mm": 50, "diameter_mm": 0.8, "inner_diameter_mm": 0.5, "young_modulus_gpa": 0.5, "poisson_ratio": 0.3,
                                               "density_g_cm3": 2}], "damping": {"mass_1_s": 0.5, "stiffness_s": 0.0002}}
        scene["tools"] = [{"name": "catheter", "kind": "microcatheter", **outer}, {"name": "wire", "kind": "wire", **tool}]
        with Navigation(scene, reward="steve") as env:
            self.assertEqual(env.action_space.shape, (2, 2))
            check_environment(env)
            env.reset()
            observation, *_ = env.step([[0, 0], [30, 0]])
            np.testing.assert_allclose(observation["inserted"], [5, 8], atol=1e-4)

    def test_recordings_replay(self):
        with tempfile.TemporaryDirectory() as folder:
            env = tube(commands=3)
            env.reset(seed=1, options={"record": f"{folder}/a.h5", "inserted_mm": 2})
            for _ in range(3):
                env.step([[10, 20]])
            self.assertFalse(env.simulator.is_recording)       # the episode has ended
            with open(f"{folder}/a.h5", "rb") as file:
                self.assertEqual(file.read(8), b"\x89HDF\r\n\x1a\n")


class Vector(unittest.TestCase):
    def test_it_is_its_environments(self):
        options = {"reward": "steve", "commands": 3, "start": Start(inserted_mm=(0, 5))}
        runs = []
        for threads in (1, 2):
            envs = VectorNavigation(TUBE, 3, threads=threads, **options)
            observation, infos = envs.reset(seed=5)
            self.assertIn(observation, envs.observation_space)
            self.assertEqual(infos["start"]["inserted_mm"].shape, (3,))
            envs.action_space.seed(1)
            path = [observation["tip"]]
            for k in range(6):
                observation, rewards, terminations, truncations, infos = envs.step(envs.action_space.sample())
                self.assertEqual((rewards.shape, terminations.shape, truncations.shape), ((3,), (3,), (3,)))
                self.assertTrue(np.all(truncations == (k == 2)))
                if k == 3:                                         # began anew
                    self.assertTrue(np.all(rewards == 0))
                path.append(observation["tip"])
            runs.append(np.array(path))
            envs.close()
        self.assertTrue(np.array_equal(runs[0], runs[1]))
        with Navigation(TUBE, **options) as env:
            for i in range(3):
                self.assertTrue(np.array_equal(env.reset(seed=5 + i)[0]["tip"], runs[0][0, i]))
        with self.assertRaisesRegex(seldinger.ArgumentError, "seeds"):
            VectorNavigation(TUBE, 2, **options).reset(seed=[1])


if __name__ == "__main__":
    unittest.main()
