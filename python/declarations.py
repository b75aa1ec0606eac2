#!/usr/bin/env python3
"""Writes seldinger/_declarations.py, what cffi needs to know of the C library, from the public headers.

usage: declarations.py FOLDER OUT.py    (FOLDER: include/seldinger)

The module is cffi's out-of-line ABI form: the package needs no compiler and no Python headers, only libseldinger.so and
python3-cffi-backend, and one build serves every Python 3.
"""
import re
import sys

import cffi

HEADERS = ["base.h", "scene.h", "simulator.h", "batch.h", "recording.h", "recon.h"]


def plain(text):
    """The declarations of a header, without what only a C or C++ compiler needs."""
    text = re.sub(r"#ifdef __cplusplus\n.*?#endif\n", "", text, flags=re.S)
    text = re.sub(r"^static inline .*?^}\n", "", text, flags=re.S | re.M)
    text = re.sub(r"^#.*\n", "", text, flags=re.M)
    return text.replace("SEL_API ", "")


def main():
    folder, out = sys.argv[1:]
    ffi = cffi.FFI()
    for name in HEADERS:
        with open(f"{folder}/{name}", encoding="utf-8") as file:
            ffi.cdef(plain(file.read()))
    ffi.set_source("seldinger._declarations", None)
    ffi.emit_python_code(out)


if __name__ == "__main__":
    main()
