"""The messages of a feed: a head of fixed size, then JSON or ring slots as they are.

A viewer gets one HELLO, all EVENTs from the begin of the run on, ROWS from now on, a STATUS now and
then, and an END. It sends lines of JSON: `{"ask": "stop" | "stop_at_once" | "mark", "text": ...,
"who": ...}`, and gets an ANSWER to each.
"""

from __future__ import annotations

import json
import struct
from typing import Any

VERSION = 1
HELLO, ROWS, EVENT, STATUS, ANSWER, END = range(1, 7)
HEAD = struct.Struct("<B3xIQ")
"""Kind, length of what follows in bytes, rows that this viewer has not been given so far."""

STOP, STOP_AT_ONCE, MARK = "stop", "stop_at_once", "mark"
ASKS = (STOP, STOP_AT_ONCE, MARK)
LONGEST_LINE_BYTES = 2048
LONGEST_TEXT = 200


class WireError(ValueError):
    """Bytes that are no message of a feed; the words say why."""


def packed(content: dict[str, Any]) -> bytes:
    """A message's JSON."""
    return json.dumps(content).encode()


def unpacked(data: bytes) -> dict[str, Any]:
    """The object of a message. Raises WireError where it is none."""
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        raise WireError("found bytes that are no JSON") from None
    if not isinstance(found, dict):
        raise WireError("found JSON that is no object")
    return found


def request(line: bytes) -> dict[str, str]:
    """What a viewer asks: `ask`, `text`, `who`, printable and short. Raises WireError."""
    found = unpacked(line)
    ask = found.get("ask")
    if ask not in ASKS:
        raise WireError(f"found the request {ask!r:.40}, expected {', '.join(ASKS)}")
    return {"ask": ask, "text": _line(found.get("text")), "who": _line(found.get("who"))}


def _line(text: object) -> str:
    """Text of others as one short line that steers no terminal."""
    words = text if isinstance(text, str) else ""
    return "".join(c if c.isprintable() else " " for c in words[:LONGEST_TEXT]).strip()
