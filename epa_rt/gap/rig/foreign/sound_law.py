"""Whether a law of a file can be fitted: what it says of its numbers, and its force, asked once."""

import math
from collections.abc import Container, Iterable, Mapping

import numpy as np

from epa_rt.gap.rig.foreign.component import Parameter, scaled
from epa_rt.gap.rig.foreign.law import Law, Motion
from epa_rt.gap.rig.foreign.plant_file import sized
from epa_rt.models.room import Fault, check_starts, check_unit

ROWS, PERIOD_S = 40, 0.01  # of the motion that a law is asked for
# of a small carriage, in SI
SETTINGS = {
    "typical_force": 20.0,
    "typical_speed": 0.15,
    "stroke": 0.2,
    "middle": 0.05,
    "pitch": 0.01,
}
NOMINAL = {"friction.viscous_n_s_m": 20.0, "carriage.inertia_kg": 4.0}
NOT_OF_A_PISTON = frozenset({"pitch", "carriage.inertia_kg"})


class _Asked(dict[str, float]):
    """Numbers, and the keys that were asked for. ``what`` is asked for and by which ``word``.
    Raises Fault for one that there is not, with ``told`` of those that there are.
    """

    def __init__(
        self,
        numbers: Mapping[str, float],
        what: str,
        told: Iterable[str] = SETTINGS,
        word: str = "",
    ) -> None:
        super().__init__(numbers)
        self.what, self.told, self.word, self.asked = what, ", ".join(told), word, set[str]()

    def __getitem__(self, key: str) -> float:
        self.asked.add(key)
        return super().__getitem__(key)

    def __missing__(self, key: str) -> float:
        raise Fault(self.word, f"{self.what} '{key}'", f"one of {self.told}")


def motion_of_a_trial() -> Motion:
    """Forth and back over most of a small carriage's stroke, two rows of it at rest."""
    time_s = PERIOD_S * np.arange(ROWS)
    half_m, rate = 0.5 * SETTINGS["stroke"], 2.0 * np.pi / (ROWS * PERIOD_S)
    ratio = 0.8 * np.cos(rate * time_s)
    place_m = SETTINGS["middle"] + half_m * ratio
    speed_m_s = -0.8 * half_m * rate * np.sin(rate * time_s)
    speed_m_s[:: ROWS // 2] = 0.0
    acceleration_m_s2 = -half_m * rate**2 * ratio
    read = (place_m, speed_m_s, acceleration_m_s2)
    return Motion(*read, *read, np.sign(speed_m_s), ratio, time_s, PERIOD_S, False)


def check_said(law: Law, names: Container[str], keys: Container[str]) -> None:
    """What a law says of its numbers. ``names``, ``keys``: effects and numbers that there are
    already. Raises Fault.
    """
    if law.effect.name in names:
        raise Fault("name", f"effect '{law.effect.name}'", "a name that no other effect has")
    for number in law.parameters:
        _check_number(number, law.effect.name, keys)
    if not law.parameters or law.parameters[0].neutral != 0.0:
        found = "a first number that is not 0 where the law is absent"
        raise Fault("numbers", found, "its strength")
    rows = law.parameters
    bounds = [(row.low, row.high) for row in rows]
    check_starts(law.effect.starts, [row.name for row in rows], bounds, "number")


def _check_number(number: Parameter, of: str, keys: Container[str]) -> None:
    if number.key in keys:
        raise Fault(number.name, f"number '{number.key}'", "a name that no other number has")
    if number.effect != of:
        raise Fault(number.name, f"number '{number.key}' of '{number.effect}'", f"of '{of}'")
    neutral = number.neutral
    if neutral is None or not number.low <= neutral <= number.high:
        raise Fault(number.name, f"'{number.key}' neutral {neutral}", "one within its bounds")
    if not 0.0 < number.spread < math.inf:
        raise Fault(number.name, f"'{number.key}' spread {number.spread:g}", "one above 0")
    check_unit(number.name, number.unit)
    scaled(number.scale, _Asked(SETTINGS, "a scale with", word=number.name))


def asked_of_a_trial(law: Law, others: Iterable[Law]) -> frozenset[str]:
    """What it asks of a rig that a carriage has and a piston has not. Its force is asked for a
    motion, at its neutral numbers and where its fits begin. ``others``: laws that a rig may have
    beside. Raises Fault, and whatever the law raises.
    """
    m, settings = motion_of_a_trial(), _Asked(SETTINGS, "setting")
    scales = [scaled(number.scale, settings) for number in law.parameters]
    asked = set(settings.asked)
    there = {**SETTINGS, **NOMINAL, **_neutral(others)}
    neutral = [*_neutral((law,)).values()]
    starts = [[x * size for x, size in zip(one, scales, strict=True)] for one in law.effect.starts]
    off = [
        [0.0 if key in law.strengths else x for key, x in zip(law.effect.knobs, one, strict=True)]
        for one in (neutral, *starts)
    ]
    for values in (*off, *starts):
        own = dict(zip(law.effect.knobs, map(np.float64, values), strict=True))
        told = _Asked({**there, **own}, "number", (*own, *SETTINGS))
        with np.errstate(all="ignore"):
            force_n = law.force_n(m, told)
        _check_force(force_n, law, values in off, own)
        asked |= told.asked
    return NOT_OF_A_PISTON & asked


def _check_force(force_n: object, law: Law, is_off: bool, numbers: Mapping[str, float]) -> None:
    word = getattr(law.force_n, "__name__", "force_n")
    if not isinstance(force_n, np.ndarray) or force_n.shape != (ROWS,):
        shape = f"of shape {force_n.shape}" if isinstance(force_n, np.ndarray) else force_n
        raise Fault(word, f"a force {shape}", f"an array of one per row, ({ROWS},) here")
    at = ", ".join(f"{key} {value:g}" for key, value in numbers.items())
    finite = np.isfinite(force_n)
    if is_off and force_n[finite].any():  # not asked there, it may end in 0/0
        largest_n = np.abs(force_n[finite]).max()
        raise Fault(word, f"a force of {largest_n:g} N at {at}", "0 N at strength 0")
    if not is_off and not finite.all():
        raise Fault(word, f"a force that is not finite at {at}", "a finite one in every row")


def _neutral(laws: Iterable[Law]) -> dict[str, float]:
    """Numbers of laws where they are absent, in SI."""
    rows = [sized(one, SETTINGS) for law in laws for one in law.parameters]
    return {row.key: row.neutral for row in rows if row.neutral is not None}
