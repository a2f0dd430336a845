"""What `epa gap blind score` wrote, read again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from epa_rt.cli.exits import VerbError

T = TypeVar("T")


def read_scored(
    path: Path, what: str, taken: Callable[[dict[str, Any]], T]
) -> tuple[str | None, T]:
    """Hash of a set's truth (None where the file does not say it, as before sets were told apart),
    and what is ``taken`` of the file. Raises VerbError where there is no ``what`` in it.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return found.get("truth_sha256"), taken(found)
    except OSError as error:
        raise VerbError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise VerbError(
            f"{path}: found no {what} in it, expected what epa gap blind score --json wrote"
        ) from None
