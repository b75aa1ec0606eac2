#!/usr/bin/env python3
"""A tour of the Python package, cell by cell as in a notebook; plots go to a folder.

usage: tutorial.py [FOLDER]     (default: the current one; needs python3-matplotlib)
"""
# %% A scene is a dictionary with the keys of a scene file: a wire in a bent tube.
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import seldinger

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
scene = {
    "vessel": {"tube": {"start_mm": [0, 0, 0], "direction": [1, 0, 0], "normal": [0, 1, 0], "radius_mm": 2,
                        "path": [{"line_mm": 15}, {"arc": {"radius_mm": 15, "angle_deg": 120}}, {"line_mm": 25}]},
               "contact": "tube", "friction": 0.1},
    "wire": {"elements": 60, "sections": [{"length_mm": 90, "diameter_mm": 0.36, "young_modulus_gpa": 20, "poisson_ratio": 0.3, "density_g_cm3": 6.45}]},
    "sheath": {"inlet": "root", "inserted_mm": 5},
    "fluoroscopy": {"anterior": [0, 0, 1], "superior": [0, 1, 0]},      # from the front one sees the x-y plane
}

# %% Push the wire in and note the force at the hand every 10 ms.
sim = seldinger.Simulator(scene)
time, push, wall = [], [], []
while sim.inserted[0] < 60:
    sim.step([[30, 0]], n=10)
    time.append(sim.time_s)
    push.append(sim.hand_force[0])
    wall.append(sim.wall_force)
print(f"after {sim.time_s:.2f} s: push {push[-1]:.4f} N, wall {wall[-1]:.4f} N, state {sim.state_hash}")

# %% The forces, the wire's shape with its contacts, and a plain X-ray picture.
figure, (forces, shape, xray) = plt.subplots(1, 3, figsize=(13, 4))
forces.plot(time, push, label="push at the hand")
forces.plot(time, wall, label="all wall forces")
forces.set(xlabel="time [s]", ylabel="force [N]")
forces.legend()
x, y, _ = sim.nodes().T
contacts = sim.contacts
shape.plot(x, y)
shape.quiver(*contacts["position_mm"][:, :2].T, *contacts["force_n"][:, :2].T, color="tab:red", width=0.006)
shape.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="wall forces")
xray.imshow(sim.image(0, 0, 256), cmap="gray", vmin=0, vmax=255)
xray.set(title="LAO 0 CRA 0")
xray.axis("off")
figure.tight_layout()
figure.savefig(folder / "tutorial-wire.png")

# %% Many at once: the push for eight stiffnesses, on all cores.
moduli = np.geomspace(5, 80, 8)
scenes = [{**scene, "wire": {**scene["wire"], "sections": [{**scene["wire"]["sections"][0], "young_modulus_gpa": e}]}} for e in moduli]
with seldinger.Batch(scenes) as batch:
    for _ in range(100):
        batch.step([[30, 0]], n=15)
    final = batch.hand_force[:, 0].copy()
figure, axes = plt.subplots(figsize=(5, 4))
axes.loglog(moduli, final, "o-")
axes.set(xlabel="Young's modulus [GPa]", ylabel="push at the hand [N]")
figure.tight_layout()
figure.savefig(folder / "tutorial-stiffness.png")
print("push by modulus: " + ", ".join(f"{e:.0f} GPa {f:.4f} N" for e, f in zip(moduli, final)))
