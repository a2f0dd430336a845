"""Laws of friction and stray forces that a sliding part may have, whoever drives it: carriage and
piston share them.

Every law is an addition to the force that the drive must give, exactly zero at its neutral numbers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.rig.foreign import laws
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.law import REST_RATIO, Law, Motion, kept, law, number

FRICTION = "friction"
REVERSAL = "reversal"  # how dry friction turns over, whatever its level
PRESLIDING_LEAST = (
    2e-4  # of the stroke: friction that builds up faster is dry friction without pre-sliding
)


def _stribeck(m: Motion, p: Numbers) -> np.ndarray:
    return (
        p["friction.stribeck_n"]
        * np.exp(-((m.speed_m_s / p["friction.stribeck_speed_m_s"]) ** 2))
        * m.sign
    )


def _rounding(m: Motion, p: Numbers) -> np.ndarray:
    """What rounded dry friction differs by from that of one level, rounded off as its sign is."""
    if p["friction.rounding_speed_m_s"] == 0.0 or p["friction.coulomb_n"] == 0.0:
        return np.zeros_like(m.speed_m_s)
    least = REST_RATIO * p["typical_speed"]
    rounded = np.tanh(m.speed_m_s / (least + p["friction.rounding_speed_m_s"]))
    return p["friction.coulomb_n"] * (rounded - np.tanh(m.speed_m_s / least))


def _dahl(m: Motion, p: Numbers) -> np.ndarray:
    if p["friction.dahl_n"] == 0.0:
        return np.zeros_like(m.speed_m_s)
    from epa_rt.gap.rig.foreign.operators import dahl

    return p["friction.dahl_n"] * dahl(
        np.diff(m.position_m, prepend=m.position_m[0]), p["friction.dahl_distance_m"]
    )


def _lugre(m: Motion, p: Numbers) -> np.ndarray:
    if p["friction.lugre_n"] == 0.0:
        return np.zeros_like(m.speed_m_s)
    from epa_rt.gap.rig.foreign.operators import lugre

    return p["friction.lugre_n"] * lugre(
        m.speed_m_s,
        m.period_s,
        p["friction.lugre_distance_m"],
        p["friction.lugre_rise_ratio"],
        p["friction.lugre_speed_m_s"],
    )


def _viscous_warming(m: Motion, p: Numbers) -> np.ndarray:
    return (
        p["friction.warming_n_s_m"]
        * m.speed_m_s
        * (1.0 - np.exp(-m.time_s / p["friction.warming_s"]))
    )


_OWN: tuple[Law, ...] = (
    law(
        "coulomb",
        FRICTION,
        "dry friction of one level",
        "F = Fc sgn(v)",
        "Coulomb; EMPS benchmark (Janot, Gautier, Brunot 2019)",
        (number("coulomb_n", "N", "coulomb", 0.0, 5.0, 0.3, "typical_force"),),
        ((0.3,),),
        lambda m, p: p["friction.coulomb_n"] * m.sign,
    ),
    law(
        "coulomb_rounding",
        REVERSAL,
        "dry friction of one level that turns over gradually: lubricated, or a simulator's way",
        "F = Fc (tanh(v/(v0 + vr)) - tanh(v/v0)) beside Fc sgn(v), v0 = r v_typical",
        "the usual smooth stand-in for Coulomb's law in simulators",
        (number("rounding_speed_m_s", "m/s", "coulomb_rounding", 0.0, 0.3, 0.01, "typical_speed"),),
        ((0.01,), (0.05,)),
        _rounding,
    ),
    law(
        "presliding",
        REVERSAL,
        "a way over which the plant's own dry friction builds up after a reversal",
        "z in place of sgn(v) in every dry friction, dz/dx = (1 - z sgn(v)) / s",
        "Dahl 1968",
        (number("presliding_m", "m", "presliding", 0.0, 0.1, 5e-3, "stroke"),),
        ((5e-3,), (5e-4,)),
        lambda m, p: np.zeros_like(m.speed_m_s),  # it acts in the others: ``in_contact``
    ),
    law(
        "stribeck",
        "stribeck",
        "friction that rises towards standstill, beside a level of its own or not",
        "F = Fs exp(-(v/vs)^2) sgn(v)",
        "Stribeck; Armstrong-Helouvry 1994",
        (
            number("stribeck_n", "N", "stribeck", 0.0, 5.0, 0.2, "typical_force"),
            number("stribeck_speed_m_s", "m/s", "stribeck", 2e-3, 0.3, 0.05, "typical_speed", 0.05),
        ),
        ((0.2, 0.05), (0.2, 0.15)),
        _stribeck,
    ),
    law(
        "dahl",
        FRICTION,
        "dry friction with pre-sliding",
        "dz/dx = (1 - z sgn(v)) / s, F = Fd z",
        "Dahl 1968",
        (
            number("dahl_n", "N", "dahl", 0.0, 5.0, 0.3, "typical_force"),
            number("dahl_distance_m", "m", "dahl", PRESLIDING_LEAST, 0.1, 5e-3, "stroke", 5e-3),
        ),
        ((0.3, 5e-3), (0.3, 1e-3)),
        _dahl,
    ),
    law(
        "lugre",
        FRICTION,
        "dry friction with pre-sliding and a rise towards standstill",
        "LuGre: dz/dt = (v - |v| z/g) / s, F = Fl z, g = 1 + r exp(-(v/vs)^2)",
        "Canudas de Wit et al. 1995",
        (
            number("lugre_n", "N", "lugre", 0.0, 5.0, 0.3, "typical_force"),
            number("lugre_distance_m", "m", "lugre", PRESLIDING_LEAST, 0.1, 5e-3, "stroke", 5e-3),
            number("lugre_rise_ratio", "1", "lugre", 0.0, 2.0, 0.3, "", 0.0),
            number("lugre_speed_m_s", "m/s", "lugre", 2e-3, 0.3, 0.05, "typical_speed", 0.05),
        ),
        ((0.3, 5e-3, 0.3, 0.05),),
        _lugre,
    ),
    law(
        "viscous_quadratic",
        "viscous",
        "drag that grows with the square of speed",
        "F = c v |v|",
        "turbulent drag, shear thinning (negative)",
        (
            number(
                "quadratic_n_s2_m2",
                "N*s^2/m^2",
                "viscous_quadratic",
                -5.0,
                5.0,
                0.2,
                "typical_force/typical_speed/typical_speed",
            ),
        ),
        ((0.2,), (-0.2,)),
        lambda m, p: p["friction.quadratic_n_s2_m2"] * m.speed_m_s * np.abs(m.speed_m_s),
    ),
    law(
        "warming",
        "warming",
        "drag that changes as the rig warms up",
        "F = c v (1 - exp(-t/T))",
        "viscosity over temperature",
        (
            number(
                "warming_n_s_m", "N*s/m", "warming", -5.0, 5.0, 0.2, "typical_force/typical_speed"
            ),
            number("warming_s", "s", "warming", 1.0, 3600.0, 10.0, "", 30.0),
        ),
        ((-0.2, 10.0), (0.2, 10.0)),
        _viscous_warming,
    ),
    law(
        "offset",
        "offset",
        "a constant force: tilt, or an amplifier's zero",
        "F = F0",
        "EMPS benchmark (Janot, Gautier, Brunot 2019)",
        (number("offset_n", "N", "offset", -5.0, 5.0, 0.1, "typical_force"),),
        ((0.1,), (-0.1,)),
        lambda m, p: np.full_like(m.speed_m_s, p["friction.offset_n"]),
    ),
    law(
        "offset_moving",
        "offset",
        "dry friction that differs by direction",
        "F = F1 sgn(v)^2",
        "asymmetric Coulomb friction",
        (number("offset_moving_n", "N", "offset_moving", -5.0, 5.0, 0.1, "typical_force"),),
        ((0.1,), (-0.1,)),
        lambda m, p: p["friction.offset_moving_n"] * m.sign**2,
    ),
    law(
        "offset_with_speed",
        "offset",
        "drag that differs by direction: an offset that grows with speed",
        "F = c |v|",
        "asymmetric viscous friction",
        (
            number(
                "asymmetric_n_s_m",
                "N*s/m",
                "offset_with_speed",
                -5.0,
                5.0,
                0.1,
                "typical_force/typical_speed",
            ),
        ),
        ((0.1,), (-0.1,)),
        lambda m, p: p["friction.asymmetric_n_s_m"] * np.abs(m.speed_m_s),
    ),
    law(
        "friction_over_place",
        "place",
        "dry friction that varies along the way",
        "F = (a X + b X^2) sgn(v)",
        "bent guide, worn middle",
        (
            number("place_linear_n", "N", "friction_over_place", -5.0, 5.0, 0.1, "typical_force"),
            number("place_square_n", "N", "friction_over_place", -5.0, 5.0, 0.1, "typical_force"),
        ),
        ((0.1, 0.0), (0.0, 0.1)),
        lambda m, p: (
            (
                p["friction.place_linear_n"] * m.place_ratio
                + p["friction.place_square_n"] * m.place_ratio**2
            )
            * m.sign
        ),
    ),
    law(
        "spring",
        "spring",
        "a force that grows along the way: a cable chain, a bellows",
        "F = k (X - X_0)",
        "drag chain stiffness",
        (
            number("spring_n", "N", "spring", -5.0, 5.0, 0.1, "typical_force"),
            number("spring_rest_ratio", "1", "spring", -3.0, 3.0, 0.5, ""),
        ),
        ((0.1, 0.0), (0.1, 1.0), (0.1, -1.0)),
        lambda m, p: p["friction.spring_n"] * (m.place_ratio - p["friction.spring_rest_ratio"]),
    ),
)

LAWS: tuple[Law, ...] = (*_OWN, *laws.found(_OWN))
PRESLIDING_M = "friction.presliding_m"


def in_contact(m: Motion, numbers: Numbers) -> Motion:
    """A motion whose direction, as friction feels it, turns over gradually where ``presliding`` is
    in the plant.
    """
    return m if numbers[PRESLIDING_M] == 0.0 else kept(_gradual, m, numbers)


def _gradual(m: Motion, numbers: Numbers) -> Motion:
    from epa_rt.gap.rig.foreign.operators import dahl

    moved_m = np.diff(m.position_m, prepend=m.position_m[0])
    return replace(m, sign=dahl(moved_m, numbers[PRESLIDING_M]))


def stray_force_n(m: Motion, numbers: Numbers, laws: Sequence[Law] = LAWS) -> np.ndarray:
    """Sum of all laws, (N,), N; nobody may change it."""
    return kept(_sum_n, m, numbers, tuple(laws))


def _sum_n(m: Motion, numbers: Numbers, laws: tuple[Law, ...]) -> np.ndarray:
    forces = [
        kept(one.force_n, m, numbers)
        for one in laws
        if any(numbers[key] != 0.0 for key in one.strengths)
    ]
    return sum(forces[1:], forces[0]) if forces else np.zeros_like(m.speed_m_s)


def motion_features(m: Motion) -> Mapping[str, np.ndarray]:
    """What a force may depend on, (N,) each."""
    return {
        "position_m": m.position_m,
        "speed_m_s": m.speed_m_s,
        "acceleration_m_s2": m.acceleration_m_s2,
    }
