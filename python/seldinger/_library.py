"""The C library: where it is found, its contexts, and its faults as exceptions."""
from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any, Union

from ._declarations import ffi

PathLike = Union[str, "os.PathLike[str]"]

LIBRARY_NAME = "libseldinger.so.0"


def _load() -> Any:
    """$SELDINGER_LIBRARY; the library of a wheel, beside this file; or the system's."""
    beside = Path(__file__).with_name(LIBRARY_NAME)
    name = os.environ.get("SELDINGER_LIBRARY") or (str(beside) if beside.exists() else LIBRARY_NAME)
    try:
        return ffi.dlopen(name)
    except OSError as error:
        raise ImportError(f"the library of Seldinger cannot be loaded: {error}; install the package seldinger, or set "
                          f"SELDINGER_LIBRARY to the path of {LIBRARY_NAME}") from None


lib = _load()

# HDF5, which reads and writes trees, models and recordings, is not thread-safe: one call at a time.
file_lock = threading.RLock()


def text_of(characters: Any) -> str:
    """A text of the library; "" for NULL."""
    return ffi.string(characters).decode("utf-8", "replace") if characters else ""


def path_bytes(path: PathLike) -> bytes:
    """A path as the library takes it."""
    return os.fsencode(os.fspath(path))


class Error(Exception):
    """A call of the library failed.

    Attributes:
        faults: all that is wrong, one text each, as ``FILE:LINE:COLUMN: what is wrong; what is valid``.
    """

    def __init__(self, *faults: str) -> None:
        super().__init__("\n".join(faults))
        self.faults: tuple[str, ...] = faults


class ArgumentError(Error, ValueError):
    """An argument is not finite, out of range or of another shape; nothing was done."""


class InputError(Error, ValueError):
    """A file cannot be read, or a scene, volume, tree or recording is not valid."""


class OutputError(Error):
    """A file cannot be written."""


class LibraryMemoryError(Error, MemoryError):
    """The library ran out of memory."""


class StateError(Error, RuntimeError):
    """The call is not possible now, for example recording after the first step."""


_ERROR_OF = {lib.SEL_ERROR_ARGUMENT: ArgumentError, lib.SEL_ERROR_INPUT: InputError, lib.SEL_ERROR_OUTPUT: OutputError,
             lib.SEL_ERROR_MEMORY: LibraryMemoryError, lib.SEL_ERROR_STATE: StateError}


class Context:
    """Keeps the faults of its last call. Handles that were made with it keep it alive."""

    def __init__(self, options: Any = ffi.NULL, borrowed: Any = None) -> None:
        if borrowed is not None:
            self.handle = borrowed
            return
        handle = ffi.new("SelContext **")
        if lib.sel_context_create(options, handle) != lib.SEL_OK:
            raise LibraryMemoryError("not enough memory for a context")
        self.handle = ffi.gc(handle[0], lib.sel_context_destroy)

    def check(self, status: int) -> None:
        """Raises the exception of a status that is not SEL_OK, with the library's message."""
        if status == lib.SEL_OK:
            return
        count = lib.sel_fault_count(self.handle)
        faults = [text_of(lib.sel_fault(self.handle, i)) for i in range(count)]
        raise _ERROR_OF.get(status, Error)(*(faults or [text_of(lib.sel_status_name(status))]))


def version() -> str:
    """The version of the C library, such as "0.1.0"."""
    return text_of(lib.sel_version())
