"""The tutorial runs and draws, and the wheel holds a package that runs without anything else of ours."""
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy as np

import seldinger

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Tutorial(unittest.TestCase):
    def test_it_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            said = subprocess.run([sys.executable, ROOT / "python/examples/tutorial.py", folder], check=True, capture_output=True, text=True).stdout
            self.assertIn("push by modulus: 5 GPa", said)
            for name in ("tutorial-wire.png", "tutorial-stiffness.png"):
                data = (pathlib.Path(folder) / name).read_bytes()
                self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
                self.assertGreater(len(data), 5000)


class Vtk(unittest.TestCase):
    def test_it_shows_vessel_and_wire(self):
        for name, has_it in (("python3-vtk9", importlib.util.find_spec("vtkmodules")), ("xvfb", shutil.which("xvfb-run"))):
            if not has_it:
                self.skipTest(f"{name} is not installed")
        with tempfile.TemporaryDirectory() as folder:
            said = subprocess.run(["xvfb-run", "-a", sys.executable, ROOT / "python/examples/vessel_3d.py", folder + "/a.png"], check=True, capture_output=True,
                                  text=True).stdout
            self.assertRegex(said, "^[1-9][0-9]{3,} triangles of the wall, [1-9][0-9]+ nodes of wire")
            from matplotlib.image import imread
            red, green, blue = np.moveaxis(imread(folder + "/a.png")[:, :, :3], 2, 0)
            is_wall, is_wire = (red > green + 0.1) & (red > blue + 0.1), (red < 0.55) & (red + green + blue < 1.2)
            self.assertGreater(is_wall.mean(), 0.02)
            self.assertGreater(is_wire.mean(), 0.0005)
            white = (red == 1) & (green == 1) & (blue == 1)
            self.assertGreater(white.mean(), 0.5)
            rows, columns = np.nonzero(is_wire)                    # the wire goes up through much of the picture, and lies in the wall
            self.assertGreater(np.ptp(rows), 0.3 * len(red))
            near = [is_wall[r - 12:r + 13, c - 12:c + 13].any() for r, c in zip(rows, columns)]
            self.assertGreater(np.mean(near), 0.95)


class Wheel(unittest.TestCase):
    def test_it_holds_all(self):
        with tempfile.TemporaryDirectory() as folder:
            built = pathlib.Path(seldinger.__file__).parent.parent
            made = [subprocess.run([sys.executable, ROOT / "python/make_wheel.py", built, ROOT / "scenes", "1.2.3", folder], check=True, capture_output=True, text=True).stdout.strip()
                    for _ in range(2)]
            with zipfile.ZipFile(made[1]) as wheel:
                wheel.extractall(folder + "/site")
            environment = {**os.environ, "PYTHONPATH": folder + "/site"}
            environment.pop("SELDINGER_LIBRARY", None)
            said = subprocess.run([sys.executable, "-c", "import seldinger; print(seldinger.__file__, seldinger.version())"], check=True, capture_output=True,
                                  text=True, env=environment, cwd=folder).stdout
            self.assertTrue(said.startswith(folder + "/site/seldinger/__init__.py"), said)
            self.assertTrue(os.path.exists(folder + "/site/seldinger/libseldinger.so.0"))


if __name__ == "__main__":
    if importlib.util.find_spec("matplotlib") is None:
        print("SKIPPED: python3-matplotlib is not installed")
        sys.exit(77)
    unittest.main()
