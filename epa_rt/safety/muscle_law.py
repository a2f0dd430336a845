"""A muscle's own law from the rig file: its length, its volume, the pull that a sound one has."""

import math

from epa_rt.config.rig import Muscle, Rig
from epa_rt.config.rig_sensors import MuscleLaw

# p V^n of gas shut in: 1 (slow) to 1.4 (fast), less by what the dead volume takes off
GAS_EXPONENT = 0.9
FILL_BANDS = 1.2  # of the length's band: a braid's own no-load length differs by half a mm besides
LOCKED_N_M = 2e4  # a braid that is locked is at least so stiff (docs/plant.md)
STRETCHED = 1.25  # of the no-load length: a braid that contracts by 20 %
INFINITE = math.inf


class MuscleGeometry:
    """Length (m) from the measured rows, volume and pull from the length. SI, pressures gauge.

    From ``taut_m`` and ``threshold_pa`` on a sound muscle pulls.
    """

    def __init__(self, law: MuscleLaw, rig: Rig):
        self._travel, self._joint = rig.motor.position, rig.joint.position if rig.joint else None
        self._rest, self._per_travel, self._per_joint = (
            law.rest_length,
            law.per_travel,
            law.per_joint if self._joint else 0.0,
        )
        self._b2 = law.braid_length * law.braid_length
        self._share = 1.0 / (4.0 * math.pi * law.braid_turns * law.braid_turns)
        no_load = law.braid_length / math.sqrt(3.0)
        self.taut_m, self.threshold_pa = no_load + law.length_band, law.threshold
        self._no_load, self._full = no_load, law.braid_length
        self._volume = (self._b2 - no_load * no_load) * no_load
        self._friction = law.friction * self._area(STRETCHED * no_load)
        self._rubber = law.rubber
        self._band_m, self._band_n = law.length_band, law.force_band
        self._strap = law.strap
        self._locked = (law.locked_length or INFINITE) + law.length_band
        self._locks = (law.lock_length or INFINITE) - law.length_band

    def length(self, measured: dict[str, float]) -> float:
        """The muscle's length by travel and joint, in m."""
        length: float = self._rest + self._per_travel * measured[self._travel]
        if self._joint is not None and self._per_joint:
            length += self._per_joint * measured[self._joint]
        return length

    def volume_ratio(self, length: float) -> float:
        """By how much the volume multiplies the pressure of gas shut in: 1 at no-load length, less
        where the muscle is longer.
        """
        if length < self._no_load:
            return 1.0
        if length > 0.9 * self._full:  # beyond what a braid can be: no law holds
            length = 0.9 * self._full
        ratio: float = ((self._b2 - length * length) * length / self._volume) ** GAS_EXPONENT
        return ratio

    def _area(self, length: float) -> float:
        """Pull over gauge pressure, in m^2; none where the muscle is slack."""
        area: float = (3.0 * length * length - self._b2) * self._share
        return area if area > 0.0 else 0.0

    def pull(self, gauge_pa: float, length: float, read_n: float = 0.0) -> tuple[float, float]:
        """The least and largest pull of a sound muscle, in N; ``read_n`` stretches its strap."""
        gauge_pa = max(gauge_pa, 0.0)
        friction, band = self._friction * gauge_pa, self._band_m
        braid = length - self._strap * max(read_n, 0.0)
        low = max(gauge_pa - self.threshold_pa, 0.0) * self._area(braid - band)
        if braid > self._locked:
            low += LOCKED_N_M * (braid - self._locked)
        if length > self._locks:
            return low - friction - self._band_n, INFINITE
        rubber = self._rubber * max(length + band - self._no_load, 0.0)
        high = gauge_pa * self._area(length + band) + rubber
        return low - friction - self._band_n, high + friction + self._band_n

    def filled(self, gauge_pa: float, length: float, vented_m: float, moved: bool) -> float:
        """The most that a fill adds to the pull (N) of a muscle that was ``vented_m`` long when it
        was empty. Friction adds where it has been stretched since (``moved``).
        """
        if length > self._locks:
            return INFINITE
        area = self._area(length + FILL_BANDS * self._band_m)
        rubber: float = self._rubber * max(length - vented_m, 0.0)
        return gauge_pa * (area + (self._friction if moved else 0.0)) + rubber


def geometry_of(muscle: Muscle, rig: Rig) -> MuscleGeometry | None:
    """The geometry of a muscle whose law stands in the rig file."""
    return MuscleGeometry(muscle.law, rig) if muscle.law else None
