"""What every verb that reads a log says of one that is damaged and yet usable, and how it ends."""

from collections.abc import Sequence
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, DIFFERENT
from epa_rt.cli.screen_text import filled

NOT_WHOLE = "the log is not whole"


def say_damage(log: Path, missing: Sequence[str]) -> int:
    """A line for each sentence on what the log lacks; DIFFERENT where there is one."""
    for sentence in missing:
        print(filled(f"{log}: {NOT_WHOLE}: {sentence}"))
    return DIFFERENT if missing else COMPLETED
