"""What a file is, by what stands in it, so that the wrong one in a slot is named for what it is."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from epa_rt.config.source import Located

WORDS = {
    "rig": "a rig file",
    "experiment": "an experiment file",
    "plant": "a plant file",
    "queue": "a queue file",
    "study": "a study file",
    "mapping": "a mapping of epa import",
    "zero": "the zero file of a rig",
    "foreign rig": "a rig file of others (kind: ...), which epa gap reads",
    "foreign plant": "a plant file of others (kind: ...)",
}
_MAGIC = {b"\x89MCAP0": "a log (MCAP)", b"PK\x03\x04": "a zip archive", b"\x89PNG": "a picture"}
MAGIC_BYTES = 6
_LOOKED_AT = 1 << 16  # bytes; top-level keys of every shipped file stand in the first few hundred
_KEY = re.compile(r"^([a-z_]+)\s*:", re.MULTILINE)


def kind_of(data: Any) -> str | None:
    """A key of WORDS for the plain data of a YAML file, or only its keys; None where none fits."""
    keys = set(data) if isinstance(data, (dict, set)) else set()
    for key in ("queue", "study", "mapping"):
        if key in keys:
            return key
    if "kind" in keys and "bus" not in keys and keys & {"rig", "plant"}:
        return "foreign rig" if "rig" in keys else "foreign plant"
    if keys >= {"rig", "method", "when"}:
        return "zero"
    if "rig" not in keys and "experiment" in keys:
        return "experiment"
    if "rig" in keys or keys >= {"bus", "signals"}:
        return "rig"
    return "plant" if "plant" in keys else None


def expect_kind(located: "Located", wanted: str) -> None:
    """Raises ConfigError where the file is one of another kind."""
    found = kind_of(located.data)
    if found == wanted == "rig" and not {"bus", "kind"} & set(located.data):
        raise located.error(
            (),
            "neither 'bus' nor 'kind'",
            "bus: of a rig of this house, or kind: of a rig of others (carriage, shaft, ...)",
        )
    if found is None or found == wanted:
        return
    own = next((key for key in (found, "kind", "rig", "plant") if key in located.data), None)
    raise located.error((own,) if own else (), WORDS[found], WORDS[wanted])


def named_by_magic(head: bytes) -> str | None:
    """What a binary file is by its first bytes; None where they say nothing."""
    return next((words for magic, words in _MAGIC.items() if head.startswith(magic)), None)


def begun(head: bytes) -> str:
    """What a file that nothing names begins with, in words: its first letters, or that it has
    none.
    """
    if not head:
        return "an empty file"
    shown = head.decode("ascii", "replace").replace("\n", " ").strip()
    return f"a file that begins with '{shown}'" if shown.isascii() else "a binary file"


def named(path: Path) -> str | None:
    """What a file is, in words; None where nothing tells. Never raises, nor waits at a pipe."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            head = file.read(_LOOKED_AT)
    except OSError:
        return None
    if known := named_by_magic(head):
        return known
    kind = kind_of(set(_KEY.findall(head.decode("utf-8", "replace"))))
    return WORDS[kind] if kind else None
