"""What a subject knows of the recordings that it has run: on which cycle their encoder renews, what
the plant was told, and how noisy their instruments are.
"""

import threading
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house.motions import Motions

MOST_PLANTS = 4  # per recording, beside which its noise is looked for
ANOTHER = 0.5  # how far a plant is from those seen, to be another one


@dataclass
class Known:
    """Of one ``recording``. ``phase``: the cycle of the encoder's first renewal. ``told`` (N,): its
    commands on a gapless grid of cycles, to be read only. ``noises``: plants, and by port what each
    leaves of the readings. ``motions``: what plants did in it. Fits run one recording a thousand
    times, from two threads: ``lock``.
    """

    recording: "weakref.ref[Recording]"
    phase: int
    told: np.ndarray
    noises: list[tuple[dict[str, float], dict[str, float]]] = field(default_factory=list)
    motions: Motions = field(default_factory=Motions)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def noise(
        self,
        plant: Mapping[str, float],
        apart: Callable[[Mapping[str, float], Mapping[str, float]], float],
        looked_for: Callable[[], dict[str, float]],
    ) -> dict[str, float]:
        """Port to noise: the least that a plant seen so far leaves. ``apart``: how far two plants
        are; ``looked_for``: what this one leaves.
        """
        with self.lock:
            if not self.noises or (
                len(self.noises) < MOST_PLANTS
                and not any(apart(one, plant) < ANOTHER for one, _ in self.noises)
            ):
                self.noises.append((dict(plant), looked_for()))
            return {port: min(left[port] for _, left in self.noises) for port in self.noises[0][1]}


class AllKnown:
    """Of all recordings that are still there: what is known of one hangs on nothing that another
    one was asked for.
    """

    def __init__(self) -> None:
        self._found: dict[int, Known] = {}
        self._lock = threading.Lock()

    def of(
        self, recording: Recording, phase: Callable[[], int], told: Callable[[], np.ndarray]
    ) -> Known:
        """What is known of this very recording; ``phase`` and ``told`` are asked for once."""
        key = id(recording)
        with self._lock:
            found = self._found.get(key)
            if found is None or found.recording() is not recording:
                self._found[key] = found = Known(
                    weakref.ref(recording, lambda _: self._found.pop(key, None)), phase(), told()
                )
            return found
