#!/usr/bin/env python3
"""The bench of zoarski.yaml with what is assumed there varied: the largest push of the hand over the whole path, against the published forces.
From the project's root: scenes/coaxial/zoarski.py [PROGRAM]; default build/release/seldinger."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

program = sys.argv[1] if len(sys.argv) > 1 else "build/release/seldinger"
scene = (pathlib.Path(__file__).parent / "zoarski.yaml").read_text()
WIRE = 1 / 0.784905         # GPa a N mm2, I = pi/64 0.3556^4
CATHETER = 1 / 8.718            # GPa a N mm2, I = pi/64 (0.7^4 - 0.5^4)


def varied(wire, catheter, friction, radius):
    text = re.sub(r"friction(_inside)?: 0\.05", lambda m: f"friction{m[1] or ''}: {friction}", scene)
    text = text.replace("12.74,", f"{WIRE * wire:.5g},").replace("young_modulus_gpa: 0.4,", f"young_modulus_gpa: {CATHETER * (catheter or 1):.4g},")
    text = text.replace("{radius_mm: 10,", f"{{radius_mm: {radius},").replace("71.168", f"{134 - 2 * 3.14159265 * radius:.3f}")
    if catheter is None:
        text = re.sub(r"  - name: microcatheter.*?(?=  - name: wire)", "", text, flags=re.S).replace("inserted_mm: 12", "inserted_mm: 2")
        text = re.sub(r"microcatheter\.push.*released: 1", "wire.push_mm_s: 40, wire.twist_deg_s: 0", text)
    return text


def largest_push(folder, *values):
    path = folder / "scene.yaml"
    path.write_text(varied(*values))
    run = subprocess.run([program, "run", path, "--summary", folder / "s.json", "--quiet"], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(run.stderr)
    return json.loads((folder / "s.json").read_text())["proximal"]["force_most_n"]


rows = [(10, c, mu, 10) for mu in (0.05, 0.1) for c in (None, 1.7, 3.5, 7)]
rows += [(w, c, 0.05, 10) for w in (5, 20) for c in (None, 3.5)] + [(10, c, 0.05, r) for r in (7, 15) for c in (None, 3.5)]
print("wire [N mm2]  microcatheter [N mm2]  friction  bends [mm]  largest push [N]  published [N]")
with tempfile.TemporaryDirectory() as name:
    for wire, catheter, friction, radius in rows:
        push = largest_push(pathlib.Path(name), wire, catheter, friction, radius)
        published = "0.088 to 0.137" if catheter else "below 0.078"
        print(f"{wire:12}  {catheter or 'none':>21}  {friction:8}  {radius:10}  {push:16.3f}  {published:>14}", flush=True)
