#!/usr/bin/env python3
"""Packs the package and libseldinger.so into a wheel for any Python 3 on this kind of Linux.

usage: make_wheel.py BUILT_FOLDER SCENES_FOLDER VERSION OUT_FOLDER

The scenes that the examples and `seldinger.gym` use are installed to share/seldinger/scenes, as by the .deb. The libraries that libseldinger.so uses (HDF5, libyaml, …) are the system's: the wheel is for machines with the packages that the .deb depends on.
The same files give the same bytes.
"""
import base64
import hashlib
import pathlib
import sys
import sysconfig
import zipfile

METADATA = """Metadata-Version: 2.1
Name: seldinger
Version: {version}
Summary: Guide wires and catheters in blood vessels, in real time. For training and research, not a medical device.
License: MIT
Requires-Python: >=3.9
Requires-Dist: numpy
Requires-Dist: cffi
"""


SCENES = ("phantom/scene.yaml", "phantom/push.csv", "exercises/aneurysm.yaml", "exercises/aneurysm.csv", "steve/*.yaml", "steve/*.csv", "tools/*.yaml")


def main():
    built, scenes, version, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4])
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    info = f"seldinger-{version}.dist-info"
    files = {f"seldinger/{path.relative_to(built / 'seldinger')}": path.read_bytes()
             for path in sorted((built / "seldinger").rglob("*")) if path.is_file() and "__pycache__" not in path.parts}
    files |= {f"seldinger-{version}.data/data/share/seldinger/scenes/{path.relative_to(scenes)}": path.read_bytes()
              for pattern in SCENES for path in sorted(scenes.glob(pattern)) if ".golden" not in path.name}
    files[f"{info}/METADATA"] = METADATA.format(version=version).encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: seldinger\nRoot-Is-Purelib: false\nTag: py3-none-{platform}\n".encode()
    rows = [f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}" for name, data in files.items()]
    files[f"{info}/RECORD"] = ("\n".join(rows) + f"\n{info}/RECORD,,\n").encode()
    path = out / f"seldinger-{version}-py3-none-{platform}.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, data in files.items():
            wheel.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    print(path)


if __name__ == "__main__":
    main()
