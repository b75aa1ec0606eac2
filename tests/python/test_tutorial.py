"""The tutorial runs and draws, and the wheel holds a package that runs without anything else of ours."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

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
