"""Where the cases of the blind benchmark, their sealed truth and answers to them lie."""

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from epa_rt.cli.exits import VerbError

PARTS = "parts"  # of a sealed truth: the truth of each case while they are made


def check_sealed(cases: Path, sealed: Path) -> None:
    """That there is something to open in the end; it is not opened here. Raises VerbError,
    SealError.
    """
    from epa_rt.benchmark.kept import hash_of
    from epa_rt.benchmark.seal import HASH, KEY, TRUTH

    if not cases.is_dir():
        raise VerbError(
            f"{cases}: found no such folder, expected the cases that epa gap blind make wrote"
        )
    for name, what in ((TRUTH, "sealed truth"), (KEY, "key of the sealed truth")):
        if not (sealed / name).is_file():
            raise VerbError(
                f"{sealed / name}: found no such file, expected the {what} of {cases} (--sealed)"
            )
    if re.fullmatch("[0-9a-f]{64}", told := hash_of(cases)) is None:
        raise VerbError(
            f"{cases / HASH}: found {told[:70]!r}, expected the hash of the sealed truth, 64 hex"
            " digits"
        )


def check_answers(answers: Path | None, asks: str | None) -> None:
    """That the folder of a diagnosis' answers is there, where ``asks`` (an option) needs it. Raises
    VerbError.
    """
    if asks and answers is None:
        raise VerbError(
            f"{asks}: found no --answers, expected the folder of answers that score has kept (DIR"
            " with case_000.json)"
        )
    if answers is not None and not answers.is_dir():
        raise VerbError(
            f"{answers}: found no such folder, expected the answers that score or matrix keeps"
            " (--answers)"
        )


def check_folder(out: Path) -> None:
    """That a folder can be made, or is one. Raises VerbError."""
    if out.exists() and not out.is_dir():
        raise VerbError(f"{out}: found a file, expected a folder, or a name for a new one")


def check_new(out: Path, sealed: Path) -> None:
    """That a folder of cases is new, or one whose making was interrupted. Raises VerbError."""
    from epa_rt.benchmark.seal import HASH

    if (out / HASH).exists() or (
        out.exists() and any(out.iterdir()) and not (sealed / PARTS).exists()
    ):
        raise VerbError(
            f"{out}: found a folder with files, expected a new one (or one whose making was"
            " interrupted)"
        )


@contextmanager
def alone(out: Path) -> Iterator[None]:
    """A folder of cases, made where it is not, into which nobody else makes any meanwhile. The lock
    on it ends with the process. A file system without locks is written all the same. Raises
    VerbError.
    """
    out.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(out, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise VerbError(
                f"{out}: found a folder that another epa gap blind is at work in, expected one at a"
                " time"
            ) from None
        except OSError:
            pass
        yield
    finally:
        os.close(descriptor)


def sealed_of(cases: Path, chosen: Path | None) -> Path:
    """Where the truth of a folder of cases lies; a folder given as . or .. has its own name."""
    own = Path(os.path.abspath(cases))  # a link keeps its name
    return (chosen or own.parent / f"{own.name}.sealed").resolve()
