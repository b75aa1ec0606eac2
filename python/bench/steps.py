#!/usr/bin/env python3
"""Steps a second of simulators in the phantom, 200 elements: one alone, and a batch on all cores. Python's overhead, memory, and opening a scene again.

usage: PYTHONPATH=build/release/python python3 python/bench/steps.py [SIMULATORS [STEPS]]

Rates are by the clock, which other programs disturb; microseconds a step are processor time, which they disturb less. Each simulator follows the script, twisted
by an angle of its own.
"""
import os
import sys
import time

import numpy as np

import seldinger

SCENE = seldinger.scene_path("phantom/scene.yaml")


def resident_mb():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def run(batch, steps, group):
    """Steps the batch; returns seconds by the clock and of the processors."""
    rates = np.zeros((len(batch), 1, 2))
    rates[:, 0, 0], rates[:, 0, 1] = 20, np.linspace(-90, 90, len(batch))
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(steps // group):
        batch.step(rates, n=group)
    return time.perf_counter() - wall, time.process_time() - cpu


def main():
    count, steps = (int(v) for v in (sys.argv[1:] + ["16", "5000"][len(sys.argv) - 1:])[:2])
    scene = seldinger.Scene(SCENE)
    start = time.process_time(), time.perf_counter()
    seldinger.Scene(SCENE)
    print(f"opening the scene again: {1e3 * (time.perf_counter() - start[1]):.1f} ms by the clock, {1e3 * (time.process_time() - start[0]):.1f} ms of a processor")

    before = resident_mb()
    many = [seldinger.Simulator(scene) for _ in range(20)]
    for sim in many:
        sim.follow(20)
    print(f"memory a simulator: {(resident_mb() - before) / len(many):.2f} MB")
    del many, sim

    results = []
    for simulators, threads in ((1, 1), (count, 1), (count, 0)):
        with seldinger.Batch(scene, simulators, threads=threads) as batch:
            wall, cpu = run(batch, steps, 10)
            results.append((simulators * steps / wall, 1e6 * cpu / (simulators * steps)))
            batch.wants_hashes()
            print(f"{simulators} simulators, {threads or os.cpu_count()} threads, {steps} steps each: {results[-1][0]:.0f} steps/s, "
                  f"{results[-1][1]:.1f} us of a processor a step, states {np.bitwise_xor.reduce(batch.hashes):016x}")
    alone, one, all_ = results
    print(f"all cores against one thread: {all_[0] / one[0]:.2f} times the rate; processor time a step {all_[1] / alone[1]:.2f} times that of one simulator alone")
    print(f"if {os.cpu_count()} cores were free: {1e6 * os.cpu_count() / all_[1]:.0f} steps/s")

    with seldinger.Batch(scene, 1, threads=1, keeps_score=False) as batch:
        rates = np.zeros((1, 1, 2))
        best = {}
        for name, call in (("commands given", lambda: batch.step(rates, n=0)), ("commands written in place", lambda: batch.step(n=0))):
            times = []
            for _ in range(20):
                start = time.process_time()
                for _ in range(500):
                    call()
                times.append((time.process_time() - start) / 500)
            best[name] = 1e6 * float(np.median(times))
        print("a batch step of no steps, which is Python's overhead and one row: " + ", ".join(f"{name} {value:.1f} us" for name, value in best.items()))


if __name__ == "__main__":
    main()
