#!/usr/bin/env python3
"""A hand that learns to steer a wire into the phantom's aneurysm, by the cross-entropy method: a few minutes of processor time.

    learn_aneurysm.py -o out/agent

The hand turns the wire to an angle, pushes it fast up to one insertion and slowly up to another, and stops earlier where the X-ray picture
shows the tip at the target. These five figures are learned. A generation of hands is drawn from a normal distribution, each hand plays
episodes with starts of its own, and the distribution moves to the best quarter of them (Rubinstein 1999). The starts vary in insertion,
rotation and the gain of both hands. The hand that was learned, the distribution's mean, is then tested from starts that were not trained on.

It writes hand.json, rewards.csv, curve.png (if matplotlib is installed) and test-N.h5, the recordings of the tests:
seldinger replay out/agent/test-0.h5.
"""
from __future__ import annotations

import argparse
import json
import os
import pathlib
import queue
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from seldinger import Scene, scene_path
from seldinger.gym import Navigation, Start

SCENE = scene_path("exercises/aneurysm.yaml")
START = Start(inserted_mm=(0, 5), turned_deg=(-180, 180), push_gain=(0.9, 1.1), twist_gain=(0.9, 1.1))
OPTIONS: dict[str, Any] = {"start": START, "push_mm_s": 20.0, "twist_deg_s": 180.0, "commands": 80, "observe": ("tip", "target", "inserted", "turned")}
FIGURES = ("angle_deg", "fast_until_mm", "slow_until_mm", "slow_mm_s", "near_mm")
MEAN = np.array([0.0, 28.0, 42.0, 10.0, 1.5])          # of the first generation: the aneurysm opens some 40 mm in; no angle is preferred
DEVIATION = np.array([120.0, 8.0, 6.0, 4.0, 1.0])
LEAST = np.array([3.0, 0.5, 0.5, 0.3, 0.1])            # deviations do not fall below these
TEST_SEED = 1_000_000                                  # training uses smaller seeds
PATIENCE = 23                                          # commands for which a hand that rests waits for the target, which counts after 2 s


def wrapped(angle_deg: Any) -> Any:
    """The same angle from -180 to 180."""
    return (angle_deg + 180) % 360 - 180


def act(figures: NDArray[np.float64], observation: dict[str, Any]) -> NDArray[np.float32]:
    """The command of a hand, (1, 2): push and twist. First it turns, then it pushes."""
    angle, fast, slow, speed, near = figures
    error = wrapped(angle - np.degrees(np.arctan2(observation["turned"][0, 1], observation["turned"][0, 0])))
    inserted, distance = observation["inserted"][0], np.linalg.norm(observation["tip"][0] - observation["target"])
    push = OPTIONS["push_mm_s"] if inserted < fast else np.clip(speed, 1, OPTIONS["push_mm_s"]) if inserted < slow else 0.0
    if distance < near or abs(error) > 20:
        push = 0.0
    return np.array([[push, np.clip(5 * error, -OPTIONS["twist_deg_s"], OPTIONS["twist_deg_s"])]], np.float32)


def play(env: Navigation, figures: NDArray[np.float64], seed: int, record: Optional[pathlib.Path] = None) -> tuple[float, dict[str, Any]]:
    """An episode: the sum of its rewards, and the last ``info``."""
    observation, info = env.reset(seed=seed, options={"record": record} if record else None)
    total, rested, is_over = 0.0, 0, False
    while not is_over:
        action = act(figures, observation)
        rested = rested + 1 if action[0, 0] == 0 and abs(action[0, 1]) < 5 else 0
        observation, reward, terminated, truncated, info = env.step(action)
        total, is_over = total + reward, terminated or truncated or rested > PATIENCE
    return total, info


class Learned(NamedTuple):
    mean: NDArray[np.float64]              # (5,) the hand that was learned
    rewards: NDArray[np.float64]           # (generations, hands) mean of each hand's episodes
    reached: NDArray[np.float64]           # (generations,) share of the episodes that reached the target


def learn(generations: int, hands: int, starts: int, seed: int, threads: int = 0, tell: Any = None, scene: Any = SCENE) -> Learned:
    """The cross-entropy method. `starts`: episodes of each hand in a generation. The result does not depend on `threads`."""
    random = np.random.default_rng(seed)
    mean, deviation = MEAN.copy(), DEVIATION.copy()
    rewards, reached = np.zeros((generations, hands)), np.zeros(generations)
    shared = Scene(scene)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        idle: queue.SimpleQueue[Navigation] = queue.SimpleQueue()
        for _ in range(threads or os.cpu_count() or 1):
            idle.put(Navigation(shared, **OPTIONS))

        def play_in_any(figures: NDArray[np.float64], seed: int) -> tuple[float, dict[str, Any]]:
            env = idle.get()           # any: an episode does not depend on those before it
            try:
                return play(env, figures, seed)
            finally:
                idle.put(env)
        for generation in range(generations):
            figures = mean + deviation * random.standard_normal((hands, len(mean)))
            seeds = random.integers(TEST_SEED, size=starts).tolist()       # the hands of a generation have the same starts
            results = list(pool.map(play_in_any, np.repeat(figures, starts, axis=0), seeds * hands))
            rewards[generation] = np.reshape([total for total, _ in results], (hands, starts)).mean(axis=1)
            reached[generation] = np.mean([info["success"] for _, info in results])
            best = figures[np.argsort(-rewards[generation], kind="stable")[:max(2, hands // 4)]]
            turn = np.exp(1j * np.radians(best[:, 0])).sum()               # angles have no mean across 180 degrees; directions have
            best[:, 0] = np.degrees(np.angle(turn)) + wrapped(best[:, 0] - np.degrees(np.angle(turn)))
            mean, deviation = best.mean(axis=0), np.maximum(best.std(axis=0), LEAST)
            if tell:
                tell(generation, rewards[generation], reached[generation], mean)
    return Learned(mean, rewards, reached)


def test(mean: NDArray[np.float64], count: int, folder: Optional[pathlib.Path] = None, scene: Any = SCENE) -> list[dict[str, Any]]:
    """Plays `count` episodes from starts that were not trained on; records them in `folder`. Returns the last ``info`` of each."""
    with Navigation(scene, **OPTIONS) as env:
        return [play(env, mean, TEST_SEED + i, folder / f"test-{i}.h5" if folder else None)[1] for i in range(count)]


def draw_curve(learned: Learned, path: pathlib.Path) -> None:
    """The rewards of all hands and the share of successful episodes, by generation."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    generation = np.arange(1, len(learned.rewards) + 1)
    figure, left = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    left.plot(np.repeat(generation, learned.rewards.shape[1]), learned.rewards.ravel(), ".", color="0.7", markersize=4, label="a hand")
    left.plot(generation, learned.rewards.mean(axis=1), color="C0", label="mean of the generation")
    left.plot(generation, learned.reached, "--", color="C1", label="share of episodes in the aneurysm")
    left.set(xlabel="generation", ylabel="reward (score / 100), share", ylim=(-0.02, 1.02), xticks=generation)
    left.legend(loc="lower right", frameon=False)
    figure.savefig(path, dpi=120)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("-o", "--output", type=pathlib.Path, required=True, metavar="FOLDER")
    options.add_argument("--generations", type=int, default=10, help="default 10")
    options.add_argument("--hands", type=int, default=20, help="in a generation; default 20")
    options.add_argument("--starts", type=int, default=1, help="episodes of each hand; default 1")
    options.add_argument("--tests", type=int, default=10, help="default 10")
    options.add_argument("--seed", type=int, default=1, help="default 1")
    options.add_argument("--threads", type=int, default=0, help="default 0: all cores; the result does not depend on it")
    given = options.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    wall, processor = time.time(), time.process_time()

    def tell(generation: int, rewards: NDArray[np.float64], reached: float, mean: NDArray[np.float64]) -> None:
        print(f"generation {generation + 1:2d}: reward {rewards.mean():.3f} (best {rewards.max():.3f}), {100 * reached:.0f} % in the aneurysm, "
              f"{time.process_time() - processor:.0f} s of processor time; "
              + ", ".join(f"{name} {value:.1f}" for name, value in zip(FIGURES, mean)), flush=True)
    learned = learn(given.generations, given.hands, given.starts, given.seed, given.threads, tell)
    print(f"learned in {time.time() - wall:.0f} s, {time.process_time() - processor:.0f} s of processor time")
    (given.output / "hand.json").write_text(json.dumps(dict(zip(FIGURES, learned.mean.tolist())), indent=1) + "\n")
    np.savetxt(given.output / "rewards.csv", learned.rewards, delimiter=",", fmt="%.6f", header="rewards of the hands, a row for each generation")
    try:
        draw_curve(learned, given.output / "curve.png")
    except ImportError:
        print("no curve.png: python3-matplotlib is not installed")
    results = test(learned.mean, given.tests, given.output)
    for i, info in enumerate(results):
        start = ", ".join(f"{name} {value:.2f}" for name, value in info["start"].items())
        print(f"test-{i}: {'reached' if info['success'] else 'not reached'}, {info['points']:.0f} points, {info['time_s']:.1f} s; {start}")
    print(f"{sum(info['success'] for info in results)} of {len(results)} starts reach the aneurysm")


if __name__ == "__main__":
    main()
