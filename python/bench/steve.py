#!/usr/bin/env python3
"""How fast stEVE_bench's tasks are simulated, on one core: the scenes of scenes/steve with their scripts, by processor time.

usage: PYTHONPATH=build/release/python python3 python/bench/steve.py
"""
import time

import seldinger

REPEATS = 3                # the median is printed
COMMAND_S = 1 / 7.5        # of stEVE_bench

print("task               steps of 1 ms   steps/s   times real time   commands/s")
for name in ("basic-wire-nav", "arch-variety", "dual-device-nav"):
    sim = seldinger.Simulator(seldinger.scene_path(f"steve/{name}.yaml"))
    count = round(sim.scene.script_s / sim.scene.step_s)
    seconds = []
    for _ in range(REPEATS):
        sim.reset()
        before = time.process_time()
        sim.follow(count)
        seconds.append(time.process_time() - before)
    rate = count / sorted(seconds)[REPEATS // 2]
    print(f"{name:18} {count:13}   {rate:7.0f}   {rate * sim.scene.step_s:15.1f}   {rate * sim.scene.step_s / COMMAND_S:10.0f}", flush=True)
