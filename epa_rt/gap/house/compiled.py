"""The decorator of this folder's compiled functions: like models/compiled.py, with a cache that also knows this folder."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numba
from numba import njit

import epa_rt.models.compiled as models

_HERE = Path(__file__).parent


def _cache_folder() -> str:
    digest = hashlib.sha256(Path(models._FOLDER).name.encode())
    for file in sorted(_HERE.glob("*.py")):
        digest.update(file.name.encode() + file.read_bytes())
    return str(_HERE / "__pycache__" / f"compiled-{digest.hexdigest()[:16]}")


_FOLDER = _cache_folder()
_WRITABLE = os.access(_HERE, os.W_OK)


def compiled(function: Callable) -> Callable:
    """The function compiled by numba on first call, cached on disk; releases the interpreter's lock."""
    before = numba.config.CACHE_DIR
    if _WRITABLE:
        numba.config.CACHE_DIR = _FOLDER
    try:
        return njit(cache=True, fastmath=False, error_model="numpy", nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = before
