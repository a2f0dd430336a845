"""One decorator for every compiled function of the plant, with a cache that notices a change in any
block; and its maker.

Numba's own cache looks only at the file of the function it stores, so a plant compiled before an
edit of a block would go on running the old block. Here the cache folder is named after the text of
all files of this package instead, but for those that only describe effects.
"""

import hashlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path

import numba
from numba import njit

_PACKAGE = Path(__file__).parent
_NOT_COMPILED = (
    "catalogue",
    "knobs",
    "effect",
)  # how the names of files that no compiled function comes from begin


def text_of(package: Path, files: Iterable[Path], before: str = "") -> str:
    """Name of the text of a package's ``files``; ``before``: that of what their functions call in
    other packages.
    """
    digest = hashlib.sha256(before.encode())
    for file in sorted(files):
        digest.update(file.relative_to(package).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def compiler(package: Path, text: str, inline: bool = False) -> Callable[[Callable], Callable]:
    """The decorator for compiled functions of a package whose text is ``text``.

    It compiles on first call, deterministically (no fast maths), without the interpreter's lock,
    and caches on disk; a read-only installation falls back to numba's per-user folder.
    """
    folder, writable = (
        str(package / "__pycache__" / f"compiled-{text}"),
        os.access(package, os.W_OK),
    )

    def compiled(function: Callable) -> Callable:
        before = numba.config.CACHE_DIR
        if writable:
            numba.config.CACHE_DIR = folder
        try:
            return njit(
                cache=True, fastmath=False, error_model="numpy", nogil=True, forceinline=inline
            )(function)
        finally:
            numba.config.CACHE_DIR = before

    return compiled


TEXT = text_of(
    _PACKAGE, (file for file in _PACKAGE.rglob("*.py") if not file.name.startswith(_NOT_COMPILED))
)
compiled = compiler(_PACKAGE, TEXT, inline=True)
# for what is made of other compiled functions: it goes into its callers, which are cached
inlined = njit(fastmath=False, error_model="numpy", nogil=True, forceinline=True)
