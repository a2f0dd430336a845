"""A piston pushed or held against air: pressure and motion to the force at its rod, the seal's
friction between them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.gap.rig.foreign import terms
from epa_rt.gap.rig.foreign.component import Channel, Component, Numbers, Parameter, Setting, effect
from epa_rt.gap.rig.foreign.law import (
    LINK,
    Motion,
    either_way,
    kept,
    late,
    motion,
    sloped_otherwise,
)
from epa_rt.gap.rig.foreign.moved import smoothed
from epa_rt.gap.rig.foreign.rests import at_rest
from epa_rt.gap.rig.foreign.reversals import REVERSALS, Turning, turning_of
from epa_rt.gap.rig.foreign.signals import Signals, shifted
from epa_rt.gap.rig.foreign.terms import in_contact, motion_features, stray_force_n
from epa_rt.gap.subject import Link

LAWS = tuple(law for law in terms.LAWS if not law.asks)


@dataclass(frozen=True)
class Prepared:
    """``over_pa``: pressure over the atmosphere, low-passed; ``read_pa``: as it was read."""

    signals: Signals
    over_pa: np.ndarray
    read_pa: np.ndarray
    motion: Motion


def prepare(signals: Signals, numbers: Numbers) -> Prepared:
    """Pressure over the atmosphere, Pa, and motion, m, m/s, m/s^2, of low-passed channels, (N,)
    each. Raises ValueError where ``lowpass`` does.
    """
    position_m, filtered = smoothed(signals, numbers)
    moved = motion(
        position_m,
        signals.columns["position"],
        signals.rate_hz,
        numbers["typical_speed"],
        numbers["middle"],
        numbers["stroke"],
        filtered,
    )
    read_pa = signals.columns["pressure"] - numbers["atmosphere"]
    return Prepared(signals, signals.lowpass(read_pa), read_pa, moved)


def residual(prepared: Prepared, numbers: Numbers, link: str) -> np.ndarray:
    """(N,) measured force less that of EQUATIONS, N, at the log's rate, unfiltered."""
    return prepared.signals.columns["force"] - predicted_n(as_read(prepared, numbers), numbers)


def as_read(prepared: Prepared, numbers: Numbers) -> Prepared:
    """Motion and pressure as they were when the force that is read was there."""
    rows = numbers["sensor.force_delay_s"] * prepared.signals.rate_hz
    if rows == 0.0:
        return prepared
    moved = kept(_late, prepared.motion, numbers, prepared.signals.rate_hz)
    over_pa, read_pa = shifted(prepared.over_pa, rows), shifted(prepared.read_pa, rows)
    return replace(prepared, over_pa=over_pa, read_pa=read_pa, motion=moved)


def _late(m: Motion, n: Numbers, rate_hz: float) -> Motion:
    return late(m, n["sensor.force_delay_s"] * rate_hz, n["typical_speed"])


def predicted_n(prepared: Prepared, n: Numbers) -> np.ndarray:
    """Force at the rod of a motion, (N,), positive where it is pushed in."""
    m, slope = in_contact(prepared.motion, n), prepared.signals.slope
    over, read = prepared.over_pa - n["sensor.zero_pa"], prepared.read_pa - n["sensor.zero_pa"]
    if n["gas.pressure_lag_s"] != 0.0:
        over = over + n["gas.pressure_lag_s"] * slope(over)
        read = read + n["gas.pressure_lag_s"] * slope(read)
    area = n["piston.area_m2"] * (1.0 + n["piston.taper_ratio"] * m.place_ratio)
    force = area * read + n["friction.viscous_n_s_m"] * m.read_speed_m_s + stray_force_n(m, n, LAWS)
    if n["piston.mass_kg"] != 0.0:
        force = force + n["piston.mass_kg"] * m.read_acceleration_m_s2
    return force + n["friction.seal_ratio"] * n["piston.area_m2"] * over * m.sign


def undetermined(prepared: Prepared, numbers: Numbers) -> np.ndarray:
    """(N,) bool: rows in which the piston stands still (rests.py)."""
    return at_rest(prepared.signals, prepared.motion.speed_m_s, numbers)


def turning(prepared: Prepared, numbers: Numbers) -> Turning:
    """The piston's motion; its dry friction, and what the rows tell no better of its force, (N,),
    N.
    """
    read = as_read(prepared, numbers)
    m = read.motion
    here, less, on, back = (
        predicted_n(replace(read, motion=way), numbers)
        for way in (m, sloped_otherwise(m), *either_way(m, numbers))
    )
    return turning_of(prepared.signals, m, 0.5 * (on - back), here - less, numbers)


def features(prepared: Prepared, link: str) -> Mapping[str, np.ndarray]:
    """(N,) each, at the log's rate: pressure over the atmosphere, Pa, place, speed and
    acceleration, m, m/s, m/s^2.
    """
    return {"pressure_pa": prepared.over_pa, **motion_features(prepared.motion)}


def _p(
    key: str,
    unit: str,
    of: str | None,
    low: float,
    high: float,
    spread: float,
    neutral: float | None = 0.0,
    scale: str = "",
) -> Parameter:
    return Parameter(key, unit, neutral, low, high, spread, LINK, of, scale)


TURNED_ROUND = "typical_force*stroke/typical_speed/typical_speed"
_OWN = (
    _p("piston.area_m2", "m^2", None, 1e-8, 10.0, 0.05, None),
    _p("friction.viscous_n_s_m", "N*s/m", None, 0.0, 1e6, 0.5, None),
    # of what takes the typical force to turn round within the stroke; strokes turn round faster
    _p("piston.mass_kg", "kg", "moving_mass", 0.0, 1.0, 5e-3, scale=TURNED_ROUND),
    _p("friction.seal_ratio", "1", "seal_friction", 0.0, 1.0, 0.05),
    _p("piston.taper_ratio", "1", "taper", -0.2, 0.2, 0.01),
    _p("gas.pressure_lag_s", "s", "pressure_lag", 0.0, 1.0, 0.02),
    _p("sensor.zero_pa", "Pa", "gauge_zero", -1.5e5, 1.5e5, 3e3),
    _p("sensor.force_delay_s", "s", "force_delay", -0.5, 0.5, 0.02),
)
_EFFECTS = (
    effect(
        "moving_mass",
        "inertia",
        "piston",
        ("piston.mass_kg",),
        ((5e-3,),),
        "mass that moves with the rod",
        "F = M a",
        "Newton",
    ),
    effect(
        "seal_friction",
        "seal_friction",
        "friction",
        ("friction.seal_ratio",),
        ((0.05,),),
        "seal friction in proportion to the pressure behind it",
        "F = mu A p sgn(v)",
        "lip and O-ring seals",
    ),
    effect(
        "taper",
        "taper",
        "piston",
        ("piston.taper_ratio",),
        ((0.01,), (-0.01,)),
        "a bore that widens along the way",
        "A -> A (1 + a X)",
        "print accuracy",
    ),
    effect(
        "pressure_lag",
        "delay",
        "piston",
        ("gas.pressure_lag_s",),
        ((0.02,),),
        "a pressure that is read late",
        "p + T dp/dt",
        "tube and sensor",
    ),
    effect(
        "gauge_zero",
        "sensor",
        "sensor",
        ("sensor.zero_pa",),
        ((3e3,), (-3e3,), (-1e5,)),
        "a pressure gauge with a wrong zero; about -1 bar: it reads gauge, not absolute",
        "p = p_read - z",
        "calibration",
    ),
    effect(
        "force_delay",
        "delay",
        "piston",
        ("sensor.force_delay_s",),
        ((0.02,), (-0.02,)),
        "clocks of force and motion that are apart",
        "F(t - T)",
        "loggers",
    ),
)

EQUATIONS = (
    (
        "x and p: place and pressure as read, low-passed, x as that of a carriage; v, a, sgn(v) and"
        " X as of a carriage; over = p - atmosphere - z, over -> over + T dover/dt"
    ),
    (
        "F = A (1 + taper X) over + B v + M a + laws of friction + mu A over sgn(v); over in the"
        " first, B v and M a as read"
    ),
    "x, v, a, X and over at t - delay, by cubic interpolation; sgn(v) of that v",
    *REVERSALS,
    "residual = force - F, low-passed and thinned out to the rig file's rate",
)

COMPONENT = Component(
    kind="piston",
    says="a piston on air: pressure and motion to force",
    channels=(
        Channel(
            "position",
            "m",
            "measured place of the piston, growing as it is pushed in",
            size="stroke",
        ),
        Channel("pressure", "Pa", "absolute pressure behind it", size="atmosphere"),
        Channel("force", "N", "measured force at the rod, positive where it is pushed in"),
    ),
    settings=(
        Setting(
            "typical_force",
            "N",
            1e-6,
            1e9,
            None,
            "of the seal's friction at most; sets how strong an effect may be",
        ),
        Setting("typical_speed", "m/s", 1e-6, 1e3, None, "of its motions"),
        Setting("stroke", "m", 1e-6, 1e3, None, "length of its way"),
        Setting("middle", "m", -1e3, 1e3, 0.0, "middle of its way"),
        Setting("atmosphere", "Pa", 1e3, 1e6, 101_325.0, "absolute pressure around it"),
    ),
    links=(
        (
            Link(
                "force",
                "piston",
                "piston_force_n",
                "N",
                "pressure and motion to the force at the rod",
            ),
            "force",
        ),
    ),
    parameters=(*_OWN, *(p for law in LAWS for p in law.parameters)),
    effects=(*(law.effect for law in LAWS), *_EFFECTS),
    prepare=prepare,
    residual=residual,
    features=features,
    settled=5.0,
    undetermined=undetermined,
    turning=turning,
    needs={"force": ("position", "pressure")},
    output_is_foreseen=True,
    equations=EQUATIONS,
)
