"""Writing pages, answers and plant files: whole files only, so that an interruption leaves the old
one or the new one.
"""

import contextlib
import errno
import itertools
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.outputs import is_screen, keep_answer
from epa_rt.config.kinds import named

_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST, errno.ENOTDIR)
MAGIC = b"\x89MCAP0\r\n"


def write_whole(path: Path, text: str) -> None:
    """Writes a file in one step, making its folder; a name of a file that is no UTF-8 stands in it
    with its bytes spelt out. Raises VerbError where it cannot, or where it would write over a
    log. An answer for the screen is kept until the verb has ended.
    """
    if is_screen(path) and keep_answer(text):
        return
    with written_to(path):
        _refuse_log(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(
            "w",
            encoding="utf-8",
            errors="backslashreplace",
            dir=path.parent,
            prefix=f".{path.name}.",
            delete=False,
        ) as file:
            try:
                file.write(text)
                file.flush()
                os.chmod(file.name, 0o644)
                os.replace(file.name, path)
            except BaseException:
                os.unlink(file.name)  # a full disk, or Ctrl-C: no scraps
                raise


@contextlib.contextmanager
def written_to(path: Path) -> Iterator[None]:
    """What the disk refuses while a file is written becomes one sentence. Raises VerbError."""
    try:
        yield
    except OSError as error:
        raise cannot_write(path, error) from None


def cannot_write(path: Path, error: OSError) -> VerbError:
    """What is said of a file that could not be written: bad input where its folder takes none, a
    failure where the disk did not take this one.
    """
    if error.errno not in _NOT_ALLOWED:
        return VerbError(f"{path}: cannot be written ({error.strerror or error})", FAILED)
    return VerbError(
        f"{path}: found {_folder_of(path)}, in which nothing can be written ({error.strerror}),"
        " expected a folder that takes files"
    )


def _folder_of(path: Path) -> Path:
    """Where a file would be made: its folder, or the nearest one above that is there."""
    return next(parent for parent in path.absolute().parents if os.path.exists(parent))


def _refuse_log(path: Path) -> None:
    if not path.is_file():
        return
    with path.open("rb") as file:
        if file.read(len(MAGIC)) == MAGIC:
            raise VerbError(f"{path}: found a log, expected another name (no log is overwritten)")


def _is_of(path: Path, verb: str) -> bool:
    """Whether the comment that a file begins with says "by 'VERB'"; an empty file is nobody's."""
    with path.open(encoding="utf-8", errors="replace") as file:
        head = list(itertools.takewhile(lambda line: line.startswith("#"), file))
    return not path.stat().st_size or any(f"by '{verb}'" in line for line in head)


def check_own(path: Path | None, verb: str) -> None:
    """Raises VerbError where a file is there whose head does not name the verb as its writer: rig
    and plant files of other hands are not written over.
    """
    if path is not None and path.is_file() and not _is_of(path, verb):
        found = named(path) or "a file"
        raise VerbError(
            f"{path}: found {found} that {verb} did not write, expected a name that is free"
        )


def check_writable(path: Path | None, endings: tuple[str, ...]) -> None:
    """Raises VerbError before any work where a file could not be written in the end."""
    if path is None or is_screen(path):
        return
    if path.suffix.lower() not in endings:
        raise VerbError(
            f"{path}: found the ending '{path.suffix}', expected {' or '.join(endings)}"
        )
    if path.exists() and not path.is_file():
        raise VerbError(
            f"{path}: found {'a folder' if path.is_dir() else 'no plain file'}, expected a name for"
            " a file"
        )
    if path.exists() and not os.access(
        path, os.W_OK
    ):  # a new file would take its place all the same
        raise VerbError(
            f"{path}: found a file that is not to be written over (read-only), expected another"
            " name"
        )
    try:
        _refuse_log(path)
    except OSError as error:
        raise VerbError(
            f"{path}: found a file that cannot be read ({error.strerror}), expected a name that is"
            " free or a file to write over"
        ) from None
    folder = _folder_of(path)
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise VerbError(
            f"{path}: found {folder}, in which nothing can be written ({error.strerror}), expected"
            " a folder that takes files"
        ) from None
