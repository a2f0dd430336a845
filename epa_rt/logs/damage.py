"""What is wrong with a file: a sentence for each place, and never more than anyone reads."""

from __future__ import annotations

_MOST = 50


class Damage:
    """Sentences by the byte at which the damage begins; the first one of a place stands."""

    def __init__(self) -> None:
        self._sentences: dict[int, str] = {}
        self._more = 0

    def add(self, place: int, sentence: str) -> None:
        if place in self._sentences:
            return
        if len(self._sentences) < _MOST:
            self._sentences[place] = sentence
        else:
            self._more += 1

    def __bool__(self) -> bool:
        return bool(self._sentences)

    def sentences(self) -> list[str]:
        """In the order of the file."""
        listed = [self._sentences[place] for place in sorted(self._sentences)]
        return [*listed, f"{self._more} more places are damaged"] if self._more else listed
