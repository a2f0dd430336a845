"""How far two runs of one rig may lie apart by its valves: each may end a set anywhere in its
tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Muscle, Rig
from epa_rt.control.valve_settings import ValveSettings
from epa_rt.report.run import NotShown, Run
from epa_rt.runs.noise import Blocks

_LEAST_GAUGE_PA = 50e3  # below, a muscle carries next to nothing and a share of it means nothing
# how signals end that a muscle's pressure is in proportion to: force, torque, current
_CARRIED = ("_n", "_nm", "_a")
# and that muscles on a joint move: pressures from nothing to full move it through its range, so a
# share of a pressure moves it by at most about that share of the range
_MOVED = ("_m", "_rad", "_s")


@dataclass(frozen=True)
class Repeatability:
    """What the valves leave open, for two runs of one rig.

    ``pressures``: Pa by which each muscle's pressure may differ, by signal; ``trimmed``: the same
    while its valves are at work in a trial, which they are once it has drifted.
    """

    a: Run
    b: Run
    muscles: tuple[Muscle, ...]
    pressures: dict[str, float]
    trimmed: dict[str, float]
    atmosphere_pa: float
    has_joint: bool = False
    notes: tuple[str, ...] = ()

    def of(self, name: str, a: slice, at_work: bool, blocks: Blocks, n: int) -> np.ndarray:
        """What a signal's means may differ by because pressures were set differently, (N,).
        ``a``: the samples of run A; ``at_work``: whether a valve opens in them.
        """
        open_pa = self.trimmed if at_work else self.pressures
        if name in open_pa:
            return np.full(len(blocks.a), open_pa[name])
        moves = self.has_joint and name.endswith(_MOVED)
        if not (moves or name.endswith(_CARRIED)):
            return np.zeros(len(blocks.a))
        share = np.zeros(len(blocks.a))
        for pressure, tolerance_pa in open_pa.items():
            gauge = self.a.signals[pressure][a][: len(share) * n]
            mean = gauge.reshape(-1, n).mean(axis=1) - self.atmosphere_pa
            share += tolerance_pa / np.maximum(mean, _LEAST_GAUGE_PA)
        if moves:
            return share * max(_range(run.signals[name]) for run in (self.a, self.b))
        carried: np.ndarray = share * np.fmax(np.abs(blocks.a), np.abs(blocks.b))
        return carried

    def is_shut(self, pressure: str, a: slice, b: slice) -> bool:
        """Whether both valves of the muscle are shut all through both stretches."""
        return not self._opens([one for one in self.muscles if one.pressure == pressure], a, b)

    def is_at_work(self, a: slice, b: slice) -> bool:
        """Whether any valve is open at any time of either stretch."""
        return self._opens(self.muscles, a, b)

    def _opens(self, muscles: Sequence[Muscle], a: slice, b: slice) -> bool:
        return any(
            bool(run.signals[valve][samples].any())
            for run, samples in ((self.a, a), (self.b, b))
            for muscle in muscles
            for valve in (muscle.inlet, muscle.exhaust)
            if valve in run.signals
        )


def repeatability_of(a: Run, b: Run) -> Repeatability:
    """From the rig file of run A: twice each muscle's valve tolerance, for both runs may miss by
    one. Without a rig file that can be read nothing is allowed beside noise, and a note says so.
    """
    try:
        rig: Rig = a.rig
    except NotShown as error:
        return Repeatability(
            a, b, (), {}, {}, 0.0, False, (f"{error}: nothing is allowed for valves",)
        )
    usual = ValveSettings()
    there = [muscle for muscle in rig.muscles if muscle.pressure in a.signals]
    return Repeatability(
        a,
        b,
        tuple(rig.muscles),
        {m.pressure: 2.0 * (m.valves.tolerance or usual.tolerance_pa) for m in there},
        {m.pressure: 2.0 * (m.valves.drift or usual.drift_pa) for m in there},
        rig.atmosphere_pa,
        rig.joint is not None,
    )


def _range(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0
