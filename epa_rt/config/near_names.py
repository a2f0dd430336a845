"""Names that were probably meant, where one is not there."""

import difflib
from collections.abc import Iterable
from pathlib import Path

CLOSE = 0.6  # ratio of difflib: one slip in five letters, and what argparse itself uses
_MOST_ALIKE = 3  # names that a person reads at a glance
_MOST_NAMES = 2000  # of a folder that are looked at


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like another; None where none is close."""
    return next(iter(most_like(name, known)), None)


def most_like(name: str, known: Iterable[str], close: float = CLOSE) -> list[str]:
    """A few known names like another, the most like first; none below ``close``, 0 to 1."""
    return difflib.get_close_matches(name, sorted(known), n=_MOST_ALIKE, cutoff=close)


def did_you_mean(path: Path) -> str:
    """'; did you mean X?' for a path that is not there; '' where nothing near it is. Never raises.

    The first part that is not there is looked for among its neighbours of a like ending.
    """
    try:
        there, rest = path.parent, [path.name]
        while not there.is_dir() and there != there.parent:
            there, rest = there.parent, [there.name, *rest]
        names = [entry.name for _, entry in zip(range(_MOST_NAMES), there.iterdir(), strict=False)]
        if ending := Path(rest[0]).suffix:
            names = [name for name in names if nearest(ending, [Path(name).suffix])]
        stem = nearest(Path(rest[0]).stem, {Path(name).stem for name in names})
        if stem is None:
            return ""
        alike = [name for name in names if Path(name).stem == stem]
        meant = max(alike, key=lambda name: Path(name).suffix == Path(rest[0]).suffix)
        whole = there.joinpath(meant, *rest[1:])
        return f"; did you mean {whole}?" if whole.exists() else ""
    except (OSError, ValueError):
        return ""
