#!/usr/bin/env python3
"""Writes scenes of stEVE_bench's ArchVariety: an arch of a type and seed, and a target on the centreline of one of its branches, drawn by the same seed.
From the project's root: scenes/steve/arch_variety.py --seed 7 -o out/arch-7.yaml. The environment variable SELDINGER names the program, default
build/release/seldinger."""
import argparse
import os
import pathlib
import random
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent
program = os.environ.get("SELDINGER", "build/release/seldinger")

SCENE = """\
seldinger: 1
vessel:
  shape: {{name: arch, arch_type: {arch_type}, seed: {seed}, diameter_scale: {scale}}}
  contact: lim
  friction: 0.1
tools:
  - {{name: guidewire, kind: wire, device: {tools}/steve-guidewire.yaml, elements: 250}}
sheath: {{inlet: root, inserted_mm: 2}}
anatomy: aortic_arch
fluoroscopy: {{lao_deg: 25}}
targets:
  - {{name: target, point_mm: [{x:.3f}, {y:.3f}, {z:.3f}], radius_mm: 5}}
exercise:
  title: ArchVariety of stEVE_bench
  instructions: Bring the tip of the wire to the target in a branch of the aortic arch within 60 s.
  target: target
  hold_s: 0
  time_limit_s: 60
"""


def centreline(arch_type, seed, scale):
    """The nodes of the arch's true tree: a list of (point [mm], radius [mm], parent), the root first; parents come before children."""
    with tempfile.TemporaryDirectory() as folder:
        tree, line = f"{folder}/arch.h5", f"{folder}/arch.swc"
        for command in (["synth", "arch", "--arch-type", arch_type, "--seed", seed, "--diameter-scale", scale, "-o", tree, "--quiet"],
                        ["export", tree, "-o", line]):
            done = subprocess.run([program, *map(str, command)], capture_output=True, text=True)
            if done.returncode:
                sys.exit(done.stderr)
        rows = [line.split() for line in open(line) if not line.startswith("#")]
    number = {row[0]: i for i, row in enumerate(rows)}
    return [([float(x) for x in row[2:5]], float(row[5]), number.get(row[6], -1)) for row in rows]


def possible_targets(nodes):
    """The centres of all nodes of the aorta's branches that lie outside the aorta, as stEVE chooses them. The aorta is the first part: its nodes follow one
    another from the root."""
    aorta = [0]
    while aorta[-1] + 1 < len(nodes) and nodes[aorta[-1] + 1][2] == aorta[-1]:
        aorta.append(aorta[-1] + 1)
    in_aorta = lambda x: any(sum((a - b) ** 2 for a, b in zip(x, nodes[i][0])) < nodes[i][1] ** 2 for i in aorta)
    return [x for x, _, _ in nodes[len(aorta):] if not in_aorta(x)]


def scene(arch_type, seed, scale, tools):
    target = random.Random(seed).choice(possible_targets(centreline(arch_type, seed, scale)))
    return SCENE.format(arch_type=arch_type, seed=seed, scale=scale, tools=tools, x=target[0], y=target[1], z=target[2])


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1, help="of the arch and its target; default 1")
    options.add_argument("--arch-type", type=int, default=1, choices=[1, 2, 4, 5, 6, 7], help="variant of the branches; default 1, stEVE_bench's")
    options.add_argument("--diameter-scale", type=float, default=0.85, help="of all diameters; default 0.85, stEVE_bench's")
    options.add_argument("-o", "--output", required=True, metavar="SCENE.yaml")
    given = options.parse_args()
    tools = os.path.relpath(here.parent / "tools", pathlib.Path(given.output).resolve().parent)
    pathlib.Path(given.output).write_text(scene(given.arch_type, given.seed, given.diameter_scale, tools))
