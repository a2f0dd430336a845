"""The decorator of every compiled function of this package, with a cache that notices a change in any of its files."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numba
from numba import njit

_PACKAGE = Path(__file__).parent
_TEXT = hashlib.sha256(b"".join(file.read_bytes() for file in sorted(_PACKAGE.glob("*.py")))).hexdigest()
_FOLDER = str(_PACKAGE / "__pycache__" / f"compiled-{_TEXT[:16]}")


def compiled(function: Callable) -> Callable:
    """The function compiled on first call: deterministic, cached on disk where the package can be written."""
    before = numba.config.CACHE_DIR
    if os.access(_PACKAGE, os.W_OK):
        numba.config.CACHE_DIR = _FOLDER
    try:
        return njit(cache=True, fastmath=False, error_model="numpy", nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = before
