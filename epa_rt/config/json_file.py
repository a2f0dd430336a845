"""JSON files that other commands wrote, read with one sentence where they are none."""

import json
from pathlib import Path
from typing import Any


def read_json(path: Path, expected: str, refused: type[Exception]) -> Any:
    """What a JSON file holds. Raises ``refused`` with one sentence, which says what was
    ``expected``.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise refused(f"{path}: cannot be read ({error.strerror}), expected {expected}") from None
    except (ValueError, RecursionError) as error:
        raise refused(f"{path}: found no JSON ({error}), expected {expected}") from None
