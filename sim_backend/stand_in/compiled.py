"""The decorator of every compiled function of this package, with a cache that notices a change in any of them."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numba
from numba import njit

_PACKAGE = Path(__file__).parent
_KERNELS = ("gas", "knee", "motor", "muscle", "plant", "records", "sensors", "whole")
_TEXT = hashlib.sha256(b"".join((_PACKAGE / f"{name}.py").read_bytes() for name in _KERNELS)).hexdigest()
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
