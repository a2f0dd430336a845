"""What a subject knows of the recordings that it has run: on which cycle their encoder renews, and how noisy their instruments are."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from epa_rt.gap.recording import Recording

MOST_PLANTS = 4      # per recording, beside which its noise is looked for
MOST_RECORDINGS = 32


@dataclass
class Known:
    """Of one ``recording``. ``phase``: the cycle of the encoder's first renewal. ``noises``: plant and port to what it leaves of the readings. Fits run one recording a thousand
    times, from several threads: ``lock``."""

    recording: Recording
    phase: int
    noises: list[tuple[dict[str, float], dict[str, float]]] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def noise(self, plant: Mapping[str, float], apart: Callable[[Mapping[str, float], Mapping[str, float]], float], looked_for: Callable[[], dict[str, float]]) -> dict[str, float]:
        """Port to noise: the least that a plant seen so far leaves. ``apart``: how far two plants are, 0.5 and more of which is another one; ``looked_for``: what this one leaves."""
        with self.lock:
            if not self.noises or (len(self.noises) < MOST_PLANTS and not any(apart(one, plant) < 0.5 for one, _ in self.noises)):
                self.noises.append((dict(plant), looked_for()))
            return {port: min(left[port] for _, left in self.noises) for port in self.noises[0][1]}


class AllKnown:
    """The recordings run last."""

    def __init__(self) -> None:
        self._found: list[Known] = []
        self._lock = threading.Lock()

    def of(self, recording: Recording, phase: Callable[[], int]) -> Known:
        """What is known of this very recording; ``phase`` is asked for once."""
        with self._lock:
            found = next((one for one in self._found if one.recording is recording), None)
            if found is None:
                found = Known(recording, phase())
                self._found = [*self._found[1 - MOST_RECORDINGS:], found]
            return found
