"""Sensors in motion: each law in turn, so that all of them cost a microsecond per cycle."""

from collections.abc import Callable

from epa_rt.config.rig import Rig
from epa_rt.safety.fill_watch import FillWatch
from epa_rt.safety.gas_watch import ExchangeWatch, GasWatch, Refusal, VolumeWatch
from epa_rt.safety.hose_watch import HoseWatch
from epa_rt.safety.motion_watch import CurrentWatch, JointWatch, LawWatch, TorqueWatch
from epa_rt.safety.muscle_law import geometry_of

ROUND_S = 0.008  # in which every pressure is asked once: a tenth of the time a burst may take
ROUNDS = 3  # in which every other law is asked once

Law = Callable[[dict[str, float], dict[str, float]], Refusal | None]


class InMotion:
    """``step`` once per cycle with the outputs that were out; a refusal, or None."""

    def __init__(self, rig: Rig):
        count = max(round(ROUND_S / rig.period_s), 1)
        self._count = ROUNDS * count
        timed: list[list[GasWatch]] = [[] for _ in range(self._count)]
        turns: list[list[Law]] = [[] for _ in range(self._count)]
        for i, muscle in enumerate(rig.muscles):
            gas = GasWatch(muscle, rig, count * rig.period_s)
            for at in range(i * count // len(rig.muscles), self._count, count):
                turns[at].append(gas.step)
                timed[at].append(gas)
        slow = _slow_laws(rig, self._count * rig.period_s)
        for i, law in enumerate(slow):
            turns[(1 + i * self._count // len(slow)) % self._count].append(law)
        self._turns = tuple(tuple(laws) for laws in turns)
        self._timed = tuple(tuple(gases) for gases in timed)
        self._at = 0

    def step(
        self, measured: dict[str, float], outputs: dict[str, float], bus_ok: bool, now_ns: int = 0
    ) -> Refusal | None:
        """Asks the laws whose turn it is of what was read at ``now_ns``. Without ``bus_ok`` the
        values are old: nobody is asked.
        """
        at = self._at
        self._at = at + 1 if at + 1 < self._count else 0
        if bus_ok:
            for gas in self._timed[at]:
                gas.read_at(now_ns)
            for law in self._turns[at]:
                refusal = law(measured, outputs)
                if refusal is not None:
                    return refusal
        return None


def _slow_laws(rig: Rig, dt_s: float) -> list[Law]:
    """What is asked every ``dt_s``, as far as the rig file says enough."""
    laws: list[Law] = []
    if len(rig.muscles) == 2:
        laws.append(ExchangeWatch(rig.muscles, dt_s).step)
        known = tuple(g for muscle in rig.muscles if (g := geometry_of(muscle, rig)) is not None)
        if len(known) == 2:
            laws.append(HoseWatch(rig.muscles, known, dt_s).step)
    pulls_spool: str | None = None
    for muscle in rig.muscles:
        geometry = geometry_of(muscle, rig)
        if muscle.law is None or geometry is None:
            continue
        laws.append(VolumeWatch(muscle, geometry, rig, dt_s).step)
        if muscle.law.force:
            laws.append(LawWatch(muscle, muscle.law.force, geometry, rig, dt_s).step)
            laws.append(FillWatch(muscle, muscle.law.force, geometry, rig, dt_s).step)
            pulls_spool = muscle.law.force if muscle.law.per_travel > 0.0 else pulls_spool
    current, constant = rig.motor.current, rig.safety.sensors.torque_constant
    if current and rig.motor.speed:
        laws.append(CurrentWatch(rig, current, rig.motor.speed).step)
    if current and rig.motor.speed and pulls_spool and constant:
        laws.append(TorqueWatch(rig, pulls_spool, constant, dt_s).step)
    if rig.joint and rig.muscles:
        laws.append(JointWatch(rig, rig.joint, dt_s).step)
    return laws
