"""Answers kept in a folder, with a file in it that says of which set they are and who gave them.

Every set has a case_000: nothing but this keeps the answers to one from being counted as another's,
or an oracle's as a diagnosis'.
"""

import json
import os
from pathlib import Path

from epa_rt.benchmark.seal import HASH, SealError

OF, ORACLE = "of.json", "oracle"


def hash_of(cases: Path) -> str:
    """Hash of the truth that was sealed with these cases, which tells one set from another. Raises
    SealError.
    """
    try:
        return (cases / HASH).read_text(encoding="utf-8", errors="replace").strip()
    except OSError as error:
        raise SealError(
            f"{error.filename}: cannot be read ({error.strerror}), expected the hash that epa gap"
            " blind make wrote"
        ) from None


def take(answers: Path, cases: Path, by: str) -> None:
    """Makes a folder for answers of a set, or goes on in it; ``by``: the diagnoser, or ORACLE.
    Raises SealError where it holds others, or does not say whose.
    """
    own, found = {"truth_sha256": hash_of(cases), "by": by}, owner(answers)
    if found is None and any(answers.glob("case_*.json")):
        raise SealError(
            f"{answers}: found answers and no {OF} that says of which set and whose they are,"
            " expected a new folder: delete it, or have them kept in another one (--json)"
        )
    if found is None:
        answers.mkdir(parents=True, exist_ok=True)
        part = answers / f"{OF}.part"
        part.write_text(json.dumps(own, indent=1) + "\n", encoding="utf-8")
        os.replace(part, answers / OF)
    elif found != own:
        raise SealError(
            f"{answers / OF}: found {_words(found)}, expected {_words(own)} ({cases}): delete the"
            " folder, or have them kept in another one (--json)"
        )


def check_given(answers: Path, cases: Path) -> None:
    """That a folder of answers is a diagnosis' to these very cases. Raises SealError."""
    found = owner(answers)
    if found is None:
        raise SealError(
            f"{answers}: found no {OF} that says of which set and whose the answers are, expected"
            " those that score or matrix keeps"
        )
    if found.get("truth_sha256") != hash_of(cases) or found.get("by") == ORACLE:
        raise SealError(
            f"{answers / OF}: found {_words(found)}, expected a diagnosis' answers to the set"
            f" {hash_of(cases)[:16]} ({cases})"
        )


def owner(answers: Path) -> dict | None:
    """What the folder says of its answers; None where it says nothing, empty where nobody can read
    it.
    """
    try:
        found = json.loads((answers / OF).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _words(found: dict) -> str:
    return (
        f"answers by {found.get('by', 'nobody knows whom')} to the set"
        f" {str(found.get('truth_sha256', 'that nobody knows'))[:16]}"
    )


def telling(sealed: Path, folder: Path, *more: Path) -> list[Path]:
    """What tells the truth and must be hidden while a diagnosis runs: the seal, and in ``folder``
    (and ``more``) what score and the oracle have written: JSON, pictures, an oracle's answers.
    """
    files = [
        path
        for path in folder.iterdir()
        if path.suffix.lower() in (".json", ".html", ".htm")
        and path.name != "case.json"
        and path.is_file()
    ]
    oracles = [
        of.parent for of in folder.glob(f"*/{OF}") if (owner(of.parent) or {}).get("by") == ORACLE
    ]
    return list(
        dict.fromkeys(path.resolve() for path in (sealed, *files, *oracles, *more) if path.exists())
    )
