"""How a run of a queue ended that nobody wrote down: what its log says."""

from pathlib import Path
from typing import Any

from epa_rt.logs.reader import LogError, LogReader


def ending_unseen(log: Path) -> dict[str, Any] | None:
    """``status``, ``cause``, ``end`` and ``quiet`` of RunState for a run whose epa queue was broken
    off; None where the log is none, or its run was itself broken off without a trip.

    A trip in a log that was cut is a trip: somebody has to look before the rig runs again.
    """
    try:
        with LogReader(log) as reader:
            events, ending = reader.events(), reader.ending
    except LogError:
        return None
    said: dict[str, Any] = next((e.data for e in reversed(events) if e.kind == "summary"), {})
    left = said.get("end")
    quiet = isinstance(left, dict) and all(
        left.get(key) is True for key in ("at_rest", "vented", "drive_off")
    )
    if ending is not None and ending.outcome in ("completed", "stopped", "tripped", "failed"):
        is_whole = ending.outcome != "completed" or not ending.failure
        status = ending.outcome if is_whole else "failed"
        cause = ending.cause or ending.failure
        return {"status": status, "cause": cause, "end": ending.end, "quiet": quiet}
    # a loop that died is written down as a trip by its recorder, and says so
    trips = [e.text for e in events if e.kind == "trip" and e.data.get("outcome") != "died"]
    return {"status": "tripped", "cause": trips[0], "end": "", "quiet": False} if trips else None
