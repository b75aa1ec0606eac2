"""seldinger.gym: Gymnasium's contract, the same bits from the same seed, rewards that add up to the score, faults, and the vectorised form."""
import tempfile
import unittest

import numpy as np

import seldinger
from seldinger.gym import navigation
from seldinger.gym import (ENVIRONMENTS, Navigation, Start, VectorNavigation, arch_variety, basic_wire_nav, check_environment, check_vector_environment,
                           dual_device_nav, has_gymnasium, spaces, steve)

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
        import gymnasium
        from gymnasium.utils.env_checker import check_env
        check_env(tube(render_mode="rgb_array", image_size=32))
        for name in ENVIRONMENTS:
            options = {"scene": TUBE, "reward": "steve"} if "Navigation-" in name else {}
            env = gymnasium.make(name, render_mode="rgb_array", **options)
            check_env(env.unwrapped)
            env.close()

    def test_the_checker_finds_what_is_broken(self):
        def changed(**changes):                 # an environment whose step() returns something else: name -> function of it
            class Changed(Navigation):
                def step(self, action):
                    names = ("observation", "reward", "terminated", "truncated", "info")
                    return tuple(changes[name](value) if name in changes else value for name, value in zip(names, super().step(action)))
            return Changed

        class Forgets(Navigation):              # a seed that does nothing
            def reset(self, *, seed=None, options=None):
                return super().reset(options=options)

        class Reseeds(Navigation):              # always the same random numbers
            def reset(self, *, seed=None, options=None):
                return super().reset(seed=1, options=options)

        class Overwrites(Navigation):           # one array for all observations
            def step(self, action):
                observation, *rest = super().step(action)
                self.kept = getattr(self, "kept", observation)
                for key in observation:
                    self.kept[key][...] = observation[key]
                return (self.kept, *rest)

        class Changes(Navigation):              # the caller's action
            def step(self, action):
                action *= 0.5
                return super().step(action)

        class Old(Navigation):                  # four results, as before 0.26
            def step(self, action):
                return super().step(action)[:4]

        class OldSeed(Navigation):
            def seed(self, seed=None):
                return [seed]

        class OldReset(Navigation):
            def reset(self, *, seed=None, options=None, return_info=True):
                return super().reset(seed=seed, options=options)

        class Usual(Navigation):                # the same episode if no seed is given
            def reset(self, *, seed=5, options=None):
                return super().reset(seed=seed, options=options)

        class NoInfo(Navigation):
            def reset(self, *, seed=None, options=None):
                return super().reset(seed=seed, options=options)[0]

        class Pace(Navigation):
            def reset(self, *, seed=None, options=None):
                self.metadata = {"render_modes": ["rgb_array"]}
                return super().reset(seed=seed, options=options)

        class Grey(Navigation):
            def render(self):
                return super().render()[:, :, 0]

        class Once(Navigation):                 # close() can be called only once
            def close(self):
                if self._sim is None:
                    raise AssertionError("closed twice")
                super().close()

        class Endless(Navigation):              # a space without bounds
            def __init__(self, *given, **options):
                super().__init__(*given, **options)
                self.observation_space = spaces.OwnDict({"tip": spaces.OwnBox(-np.inf, np.inf, (1, 2))}) if not has_gymnasium else self.observation_space

        tip = lambda change: lambda observation: dict(observation, tip=change(observation["tip"]))
        cases = [(Forgets, "np_random_seed|same seed|differ"), (Reseeds, "np_random_seed|another seed"), (Overwrites, "overwrites"), (Changes, "changes the action"),
                 (Old, "does not return"), (OldSeed, "dropped"), (OldReset, "dropped"), (Usual, "default 5"), (NoInfo, "does not return"), (Pace, "render_fps"),
                 (Grey, "uint8"), (Once, "closed twice"),
                 (changed(observation=tip(lambda x: x + 5000)), "not in its space"), (changed(observation=tip(lambda x: x.astype(np.float64))), "type float64"),
                 (changed(observation=tip(lambda x: x.tolist())), "expected an array"), (changed(observation=tip(lambda x: x[0])), "shape"),
                 (changed(observation=tip(lambda x: np.repeat(x, 2, axis=1)[:, ::2])), "contiguous"),
                 (changed(observation=lambda x: dict(x, more=x["tip"])), "keys"), (changed(observation=lambda x: x["tip"]), "expected a dictionary"),
                 (changed(reward=lambda x: float("nan")), "finite float"), (changed(reward=np.float32), "finite float"), (changed(terminated=np.bool_), "no bool"),
                 (changed(truncated=int), "no bool"), (changed(info=lambda x: None), "no dictionary")]
        if not has_gymnasium:
            cases.append((Endless, "not finite"))
        for broken, words in cases:
            with self.subTest(words), self.assertRaisesRegex(AssertionError, words):
                check_environment(broken(TUBE, reward="steve", start=Start(inserted_mm=(0, 5)), render_mode="rgb_array", image_size=32), commands=3)

    def test_random_numbers_may_be_replaced(self):
        env = tube(start=Start(inserted_mm=(0, 5)))
        env.np_random = np.random.default_rng(8)
        self.assertEqual(env.np_random_seed, -1)
        expected = np.random.default_rng(8).uniform(0, 5)
        self.assertEqual(env.reset()[1]["start"]["inserted_mm"], expected)
        self.assertTrue(env.has_wrapper_attr("scene") and not env.has_wrapper_attr("colour"))
        self.assertTrue(env.set_wrapper_attr("colour", 1) and env.get_wrapper_attr("colour") == 1 and not env.set_wrapper_attr("size", 1, force=False))

    def test_pictures_a_second_are_commands_a_second(self):
        self.assertAlmostEqual(tube(command_s=0.2).metadata["render_fps"], 5)

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
            env.reset()
            observation, *_ = env.step([[0, 0], [30, 0]])
            np.testing.assert_allclose(observation["inserted"], [5, 8], atol=1e-4)
            check_environment(env)
            with self.assertRaisesRegex(seldinger.StateError, "closed"):
                env.reset()

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
        for count in (0, None):
            with self.assertRaisesRegex(seldinger.ArgumentError, "at least 1"):
                VectorNavigation(TUBE, count, **options)

    def test_each_mode_keeps_the_contract(self):
        for mode in ("NextStep", "SameStep", "Disabled"):
            with self.subTest(mode):
                envs = VectorNavigation(TUBE, 3, reward="steve", commands=2, autoreset_mode=mode, start=Start(inserted_mm=(0, 5)), render_mode="rgb_array", image_size=32)
                check_vector_environment(envs, commands=5)
        with self.assertRaisesRegex(seldinger.ArgumentError, "NextStep, SameStep, Disabled"):
            VectorNavigation(TUBE, 1, reward="steve", autoreset_mode="Never")

    def test_a_mask_begins_some(self):
        envs = VectorNavigation([tube(commands=2), tube(commands=3)], autoreset_mode="Disabled")
        with self.assertRaisesRegex(seldinger.StateError, "reset"):
            envs.reset(options={"reset_mask": np.array([True, False])})
        envs.reset(seed=1)
        push = np.full(envs.action_space.shape, 10, np.float32)
        envs.step(push)
        observation, _, _, truncated, _ = envs.step(push)
        self.assertEqual(truncated.tolist(), [True, False])
        with self.assertRaisesRegex(seldinger.StateError, "reset_mask"):
            envs.step(push)
        again, info = envs.reset(options={"reset_mask": truncated})
        self.assertEqual(info["_time_s"].tolist(), [True, False])
        self.assertTrue(np.array_equal(again["tip"][1], observation["tip"][1]) and not np.array_equal(again["tip"][0], observation["tip"][0]))
        *_, truncated, info = envs.step(push)
        self.assertEqual((truncated.tolist(), np.round(info["time_s"], 6).tolist()), ([False, True], [0.1, 0.3]))
        for mask in ([True], [False, False], [1, 0]):
            with self.subTest(mask), self.assertRaisesRegex(seldinger.ArgumentError, "reset_mask"):
                envs.reset(options={"reset_mask": np.array(mask)})
        envs.close()

    def test_the_same_step_gives_the_last_observation_and_the_first(self):
        with tube(commands=2) as alone:
            first, _ = alone.reset(seed=1)
            alone.step([[10, 0]])
            last, *_, info = alone.step([[10, 0]])
        envs = VectorNavigation(TUBE, 1, reward="steve", commands=2, autoreset_mode="SameStep")
        envs.reset(seed=1)
        push = np.array([[[10, 0]]], np.float32)
        envs.step(push)
        observation, _, _, truncated, infos = envs.step(push)
        self.assertTrue(truncated[0] and np.array_equal(observation["tip"][0], first["tip"]) and np.array_equal(infos["final_obs"][0]["tip"], last["tip"]))
        self.assertEqual(infos["final_info"]["distance_mm"][0], info["distance_mm"])
        envs.close()


class Steve(unittest.TestCase):
    """The tasks of stEVE_bench: its figures, and targets that a seed draws from the branches that it names."""

    def test_figures(self):
        for make, train, test, tools in ((basic_wire_nav, 150, 450, 1), (dual_device_nav, 500, 1000, 2), (arch_variety, 150, 450, 1)):
            with self.subTest(make.__name__), make() as env:
                self.assertEqual((env._commands, env.action_space.shape), (train, (tools, 2)))
                np.testing.assert_allclose(env.action_space.high, np.tile([35, 180], (tools, 1)))
                self.assertAlmostEqual(env.metadata["render_fps"], 7.5, delta=0.02)        # a whole number of steps of 1 ms
                self.assertEqual(env.scene.targets[0].radius, 5)
            with make("test") as env:
                self.assertEqual(env._commands, test)
        with self.assertRaisesRegex(seldinger.ArgumentError, "train or test"):
            basic_wire_nav("play")

    def test_targets_are_in_the_branches(self):
        for task in (steve.BASIC_WIRE_NAV, steve.DUAL_DEVICE_NAV):
            scene = seldinger.Scene(seldinger.scene_path(task.scene))
            nodes, branch = scene.nodes, steve.branch_of(scene.nodes)
            targets = steve.possible_targets(scene, task.branches)
            self.assertTrue(np.all(scene.query(targets)[0] > 0.5))          # in the lumen
            of = {tuple(node["center_mm"]): k for node, k in zip(nodes, branch)}
            self.assertEqual({of[tuple(point)] for point in targets}, set(task.branches))
            for point in targets:                                           # none in a branch without targets, computed one by one
                for node, k in zip(nodes, branch):
                    self.assertTrue(k in task.branches or np.linalg.norm(point - node["center_mm"]) >= node["radius_mm"])

    def test_a_vessels_end_truncates_in_training(self):
        scene = seldinger.Scene(ARCH)
        ends = navigation.vessel_ends_of(scene)
        nodes, last = scene.nodes, np.flatnonzero(ends.is_end)
        self.assertEqual(len(last), 5)                              # four branches and the heart's end; not the inlet
        self.assertFalse(set(last) & set(nodes["parent"]))
        for k in last:
            beyond, before = (ends.center_mm[k] + d * ends.direction[k] for d in (0.1, -0.1))
            self.assertTrue(ends.are_reached(beyond))
            self.assertFalse(ends.are_reached(before))
        self.assertFalse(ends.are_reached(scene.entry[0] - 5 * scene.entry[1]))
        counts = {}
        for mode in ("train", "test"):
            with basic_wire_nav(mode) as env:
                env.reset(seed=0)
                random, is_cut = np.random.default_rng(0), False
                for counts[mode] in range(1, 70):                   # into another branch than the target's
                    _, _, terminated, is_cut, info = env.step([[35, random.uniform(-180, 180)]])
                    self.assertFalse(terminated)
                    self.assertEqual(is_cut, info["vessel_end"])
                    if is_cut:
                        break
                self.assertEqual(is_cut, mode == "train")
        self.assertLess(counts["train"], 69)
        with self.assertRaisesRegex(seldinger.ArgumentError, "no centrelines"):
            tube(vessel_ends=True)

    def test_a_seed_draws_the_target(self):
        with basic_wire_nav() as env:
            points = []
            for seed in (*range(12), 0):
                env.reset(seed=seed)
                points.append(env.scene.targets[0].point)
            self.assertTrue(np.array_equal(points[0], points[-1]))
            self.assertGreater(len({tuple(point) for point in points}), 8)
            env.reset()                                                     # goes on with the random numbers
            self.assertFalse(np.array_equal(env.scene.targets[0].point, points[-1]))
            observation, *_ = env.step([[35, 0]])
            np.testing.assert_allclose(observation["target"], env._c_arm.project(env.scene.targets[0].point), rtol=1e-6)

    def test_a_seed_draws_the_arch(self):
        with arch_variety(arches=2) as env:
            seen = {}
            for seed in (0, 1, 2, 3, 4, 5, 0):
                env.reset(seed=seed)
                seen.setdefault(seed, []).append((env.scene.text.split("seed:")[1].split(",")[0].strip(" }"), tuple(env.scene.targets[0].point)))
            self.assertEqual({arch for (arch, _), *_ in seen.values()}, {"1", "2"})
            self.assertEqual(seen[0][0], seen[0][1])
            self.assertTrue(np.all(env.scene.query([env.scene.targets[0].point])[0] > 0.5))

    def test_scripts_reach_the_targets_of_the_scenes(self):
        for name in ("basic-wire-nav", "arch-variety", "dual-device-nav"):
            with self.subTest(name), seldinger.Simulator(seldinger.scene_path(f"steve/{name}.yaml")) as sim:
                sim.follow(round(sim.scene.script_s / sim.scene.step_s))
                self.assertEqual(sim.score()["state"], "reached")
                self.assertFalse(sim.flags_ever & seldinger.Flag.DIVERGED)

    def test_they_keep_the_contract(self):
        for make in (basic_wire_nav, dual_device_nav):
            with self.subTest(make.__name__):
                check_environment(make(), commands=3)
        check_vector_environment(VectorNavigation([basic_wire_nav(), basic_wire_nav()]), commands=3)

    def test_a_recorded_episode_has_the_drawn_target(self):
        with tempfile.TemporaryDirectory() as folder, basic_wire_nav(commands=2) as env:
            env.reset(seed=3, options={"record": f"{folder}/a.h5"})
            for _ in range(2):
                env.step([[35, 0]])
            np.testing.assert_allclose(seldinger.Recording(f"{folder}/a.h5").scene().targets[0].point, env.scene.targets[0].point)


if __name__ == "__main__":
    unittest.main()
