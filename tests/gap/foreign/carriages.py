"""Carriages of somebody else's simulator, each driven by a controller of its own, and the two files
that describe such a rig.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign import open_foreign
from epa_rt.gap.rig.foreign.subject import ForeignSubject
from tests.gap.foreign.made import one_trial

SUBSTEPS = 10


@dataclass(frozen=True)
class Cart:
    """What moves, what drives it and how it is read, every ``period_s``."""

    rig: str
    force_column: str
    period_s: float
    mass_kg: float
    drag_n_s_m: float
    stiffness_n_m: float
    damping_n_s_m: float
    place_noise_m: float
    force_noise_n: float
    place_step_m: float = 1e-6  # 0: read to the last bit

    def driven(
        self,
        name: str,
        reference_m: np.ndarray,
        random: np.random.Generator,
        late_rows: int = 0,
        coulomb_n: float = 0.0,
        push_n: np.ndarray | None = None,
        wave_n: float = 0.0,
        wave_m: float = 1.0,
    ) -> Recording:
        """The force in a row acts from that row to the next, or ``late_rows`` later; dry friction
        of ``coulomb_n`` holds whatever is less while nothing moves. A force of ``wave_n`` returns
        every ``wave_m``.
        """
        count, step = len(reference_m), self.period_s / SUBSTEPS
        push_n = np.zeros(count) if push_n is None else push_n
        place, force, sent = np.empty(count), np.empty(count), [0.0] * (late_rows + 1)
        q, v = float(reference_m[0]), 0.0
        speed_m_s, pushes = np.gradient(reference_m, self.period_s).tolist(), push_n.tolist()
        for k, (x, w) in enumerate(zip(reference_m.tolist(), speed_m_s, strict=True)):
            sent.append(self.stiffness_n_m * (x - q) + self.damping_n_s_m * (w - v))
            read_m, step_m = q + random.normal(0.0, self.place_noise_m), self.place_step_m
            place[k] = round(read_m / step_m) * step_m if step_m > 0.0 else read_m
            force[k] = sent[-1] + random.normal(0.0, self.force_noise_n)
            for _ in range(SUBSTEPS):
                free = (
                    v
                    + step
                    * (
                        sent[-1 - late_rows]
                        + pushes[k]
                        - wave_n * math.sin(2.0 * np.pi * q / wave_m + 0.7)
                        - self.drag_n_s_m * v
                    )
                    / self.mass_kg
                )
                v = free - math.copysign(min(abs(free), step * coulomb_n / self.mass_kg), free)
                q += step * v
        return one_trial(
            name, self.rig, self.period_s, {"place_m": place, self.force_column: force}
        )


STRANGER = Cart(
    "stranger",
    "cmd_force_n",
    1e-3,
    mass_kg=42.0,
    drag_n_s_m=160.0,
    stiffness_n_m=60_000.0,
    damping_n_s_m=2500.0,
    place_noise_m=2e-6,
    force_noise_n=0.15,
)


def opened(
    folder: Path, rig: str, plant: str, leave_out: frozenset[str] = frozenset()
) -> ForeignSubject:
    """The rig of these two files' texts, without some effects of its catalogue."""
    (folder / "rig.yaml").write_text(rig, encoding="utf-8")
    (folder / "plant.yaml").write_text(plant, encoding="utf-8")
    return open_foreign(folder / "rig.yaml", None, leave_out)
