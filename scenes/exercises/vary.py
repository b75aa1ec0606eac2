#!/usr/bin/env python3
"""How much room a solving hand leaves: its scene with all insertions 5 % and all friction 20 % larger or smaller, all tools turned by 10 degrees more or less,
and all three together. Prints what each variant of each exercise scores. From the project's root: scenes/exercises/vary.py EXERCISE... ; the environment
variable SELDINGER names the program, default build/release/seldinger."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent
program = os.environ.get("SELDINGER", "build/release/seldinger")
VARIANTS = [(1, 1, 0), (1.05, 1, 0), (0.95, 1, 0), (1, 1.2, 0), (1, 0.8, 0), (1, 1, 10), (1, 1, -10), (1.05, 1.2, 10), (0.95, 0.8, -10)]


def varied_script(text, push, turn):
    """All pushes times `push`; each tool is turned by `turn` degrees more in the first row that turns it, else in the first row."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    names, rows = lines[0].split(","), [[float(x) for x in line.split(",")] for line in lines[1:]]
    for column, name in enumerate(names):
        if name.endswith("push_mm_s"):
            for row in rows:
                row[column] *= push
        if name.endswith("twist_deg_s"):
            at = next((i for i, row in enumerate(rows) if row[column] != 0), 0)
            rows[at][column] += turn / (rows[at + 1][0] - rows[at][0])
    return "\n".join([lines[0]] + [",".join(f"{x:.9g}" for x in row) for row in rows]) + "\n"


def run(folder, name, push, friction, turn):
    scene = (here / f"{name}.yaml").read_text().replace(" ../", f" {here.parent}/")
    scene = re.sub(r"(friction(?:_inside)?): ([0-9.]+)", lambda m: f"{m[1]}: {float(m[2]) * friction:.9g}", scene)
    (folder / f"{name}.yaml").write_text(scene)
    (folder / f"{name}.csv").write_text(varied_script((here / f"{name}.csv").read_text(), push, turn))
    done = subprocess.run([program, "run", folder / f"{name}.yaml", "--score", folder / "score.json", "--quiet"], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    return json.loads((folder / "score.json").read_text())


for name in sys.argv[1:]:
    reached = 0
    with tempfile.TemporaryDirectory() as folder:
        for push, friction, turn in VARIANTS:
            score = run(pathlib.Path(folder), name, push, friction, turn)
            reached += score["state"] == "reached" and (push, friction, turn) != VARIANTS[0]
            errors = ", ".join(f"{kind} {error['count']}" for kind, error in score["errors"].items() if error["count"])
            print(f"{name}: insertions x {push}, friction x {friction}, turned {turn:+} deg: {score['state']}, {score['points']:.0f} points, "
                  f"{score['target_distance_mm']:.1f} mm from the target {errors}", flush=True)
    print(f"{name}: {reached} of {len(VARIANTS) - 1} variants reach the target", flush=True)
