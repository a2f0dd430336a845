"""What a broken file is: a sound one, one edit, and the sentence that answers it."""

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RIGS, PLANTS, EXPERIMENTS = (
    ROOT / "config" / folder for folder in ("rigs", "plants", "experiments")
)


@dataclass(frozen=True)
class Broken:
    """``old`` becomes ``new`` once. ``at``: text that stands on the line to be named (first such
    line), or its number.

    ``found`` and ``expected`` are parts of the sentence. ``of``: the sound file.
    """

    name: str
    old: str
    new: str
    at: str | int
    found: str
    expected: str
    of: str = ""

    def text(self, sound: str) -> str:
        assert self.old in sound, f"{self.name}: the sound file no longer has {self.old!r}"
        return sound.replace(self.old, self.new, 1)

    def line(self, text: str) -> int:
        if isinstance(self.at, int):
            return self.at
        lines = text.split("\n")
        return next(n for n, line in enumerate(lines, 1) if self.at in line)


def table(of: str, *rows: tuple) -> list[Broken]:
    return [Broken(*row, of=of) for row in rows]
