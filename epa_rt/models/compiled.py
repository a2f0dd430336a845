"""One decorator for every compiled function of the plant, with a cache that notices a change in any block.

Numba's own cache looks only at the file of the function it stores, so a plant compiled before an edit of a block would
go on running the old block. Here the cache folder is named after the text of all files of this package instead, but for
those that only describe effects.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numba
from numba import njit

_PACKAGE = Path(__file__).parent
_NOT_COMPILED = ("catalogue", "knobs", "effect")  # how the names of files that no compiled function comes from begin


def _cache_folder() -> str:
    digest = hashlib.sha256()
    for file in sorted(_PACKAGE.rglob("*.py")):
        if file.name.startswith(_NOT_COMPILED):
            continue
        digest.update(file.relative_to(_PACKAGE).as_posix().encode())
        digest.update(file.read_bytes())
    return str(_PACKAGE / "__pycache__" / f"compiled-{digest.hexdigest()[:16]}")


_FOLDER = _cache_folder()
_WRITABLE = os.access(_PACKAGE, os.W_OK)  # a read-only installation falls back to numba's per-user folder


def compiled(function: Callable) -> Callable:
    """The function compiled by numba on first call: deterministic (no fast maths), cached on disk."""
    before = numba.config.CACHE_DIR
    if _WRITABLE:
        numba.config.CACHE_DIR = _FOLDER
    try:
        return njit(cache=True, fastmath=False, error_model="numpy", nogil=True, forceinline=True)(function)
    finally:
        numba.config.CACHE_DIR = before
