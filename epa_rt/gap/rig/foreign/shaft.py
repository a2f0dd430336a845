"""A motor that turns something: angle and torque. The carriage's balance in rotation, and the
weight of what hangs on it.

Inertia stands for mass, an angle for a place, a torque for a force; every law of a carriage is one
of a shaft in these units. So the carriage's equations run here on numbers under the carriage's
names, and this module only translates: keys, units, settings, roles.
"""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from epa_rt.config.units import suffix_of
from epa_rt.gap.rig.foreign import carriage
from epa_rt.gap.rig.foreign.component import Channel, Numbers, Parameter, Setting, effect
from epa_rt.gap.rig.foreign.law import Law
from epa_rt.gap.rig.foreign.plant_file import stem
from epa_rt.gap.rig.foreign.reversals import Turning
from epa_rt.gap.rig.foreign.signals import Signals
from epa_rt.gap.rig.foreign.terms import LAWS
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect

LINK = "torque"
IN_ROTATION = {"N": "N*m", "m": "rad", "kg": "kg*m^2"}
ROLES = {"angle": "position", "torque": "force"}
SETTINGS = {
    "typical_torque": "typical_force",
    "turn": "pitch",
}  # those that are called otherwise on a carriage
_LEAST = {"carriage.inertia_kg": 1e-9}
# Without a gear a torque that returns once to a turn is a weight by another name: cogging is asked
# from twice to a turn on, or, of a way of more than a turn, from a little above twice on the way.
PERIODS, TWICE, ABOVE = "drive.cogging_periods", 2.0, 1.05
_GRAVITY = Law(
    effect(
        "gravity",
        "load",
        "load",
        ("load.gravity_sine_n", "load.gravity_cosine_n"),
        ((0.3, 0.0), (0.0, 0.3)),
        "weight of what hangs on the shaft",
        "T = a sin(q) + b cos(q)",
        "pendulum, robot arm",
    ),
    tuple(
        Parameter(
            f"load.gravity_{part}_n",
            "N",
            0.0,
            -5.0,
            5.0,
            0.3,
            carriage.LINK,
            "gravity",
            "typical_force",
        )
        for part in ("sine", "cosine")
    ),
    lambda m, p: (
        p["load.gravity_sine_n"] * np.sin(m.position_m)
        + p["load.gravity_cosine_n"] * np.cos(m.position_m)
    ),
)
_ALL: tuple[Law, ...] = (*LAWS, _GRAVITY)


def _renamed(row: Parameter) -> str:
    """The shaft's key of a carriage's number: 'carriage.inertia_kg' is 'shaft.inertia_kg_m2'."""
    block, unit = "shaft" if row.block == "carriage" else row.block, in_rotation(row.unit)
    return f"{block}.{row.name if unit == row.unit else stem(row) + suffix_of(unit)}"


def in_rotation(unit: str) -> str:
    """The unit in rotation: rad for m, N*m for N, kg*m^2 for kg. 'N/m^3' is 'N*m/rad^3'."""
    return re.sub(r"\b(N|m|kg)\b", lambda one: IN_ROTATION[one[0]], unit)


_ROWS = (*carriage.COMPONENT.parameters, *_GRAVITY.parameters)
KEYS = {_renamed(row): row.key for row in _ROWS}
_BACK = {theirs: ours for ours, theirs in KEYS.items()}


def _scale(text: str) -> str:
    for ours, theirs in SETTINGS.items():
        text = text.replace(theirs, ours)
    return text


def _as_carriage(numbers: Numbers) -> dict[str, float]:
    return {KEYS.get(key, SETTINGS.get(key, key)): value for key, value in numbers.items()}


def prepare(signals: Signals, numbers: Numbers) -> carriage.Prepared:
    """As carriage.prepare, of angle and torque: rad for m, N*m for N."""
    alike = replace(
        signals,
        columns={ROLES[role]: values for role, values in signals.columns.items()},
        valid={ROLES[role]: values for role, values in signals.valid.items()},
    )
    return carriage.prepare(alike, _as_carriage(numbers))


def residual(prepared: carriage.Prepared, numbers: Numbers, link: str) -> np.ndarray:
    """(N,) the drive's torque less what ``numbers`` ask of it, N*m: as carriage.residual, with the
    weight that hangs on the shaft.
    """
    return carriage.residual(prepared, _as_carriage(numbers), link, _ALL)


def undetermined(prepared: carriage.Prepared, numbers: Numbers) -> np.ndarray:
    """(N,) bool: as carriage.undetermined."""
    return carriage.undetermined(prepared, _as_carriage(numbers))


def turning(prepared: carriage.Prepared, numbers: Numbers) -> Turning:
    """As carriage.turning, rad for m, N*m for N."""
    return carriage.turning(prepared, _as_carriage(numbers), _ALL)


def features(prepared: carriage.Prepared, link: str) -> Mapping[str, np.ndarray]:
    """(N,) each, at the log's rate: low-passed angle, its speed and acceleration, rad, rad/s,
    rad/s^2, and turn of the motor, rad.
    """
    m = prepared.base
    return {
        "angle_rad": m.position_m,
        "speed_rad_s": m.speed_m_s,
        "acceleration_rad_s2": m.acceleration_m_s2,
        "motor_turn_rad": prepared.turned_rad,
    }


def _parameter(row: Parameter) -> Parameter:
    if row.key == PERIODS:
        row = row._replace(neutral=TWICE, low=ABOVE * carriage.SEEN_TWICE)
    return row._replace(
        key=_renamed(row),
        unit=in_rotation(row.unit),
        low=_LEAST.get(row.key, row.low),
        links=(LINK,),
        scale=_scale(row.scale),
        low_scale=_scale(row.low_scale),
    )


def _effect(one: Effect) -> Effect:
    says = re.sub(r"\bcarriage\b", "shaft", re.sub(r"\bforce\b", "torque", one.says))
    starts = tuple(
        tuple(
            max(x, TWICE) if key == PERIODS else x for key, x in zip(one.knobs, start, strict=True)
        )
        for start in one.starts
    )
    return one._replace(
        knobs=tuple(_BACK[key] for key in one.knobs), says=says, starts=tuple(dict.fromkeys(starts))
    )


COMPONENT = replace(
    carriage.COMPONENT,
    kind="shaft",
    says="a motor that turns a load, an arm or a pendulum: angle and the torque asked of the drive",
    channels=(
        Channel("angle", "rad", "measured angle of the shaft", size="stroke"),
        Channel(
            "torque", "N*m", "controller's output times the drive's gain", size="typical_torque"
        ),
    ),
    settings=(
        Setting(
            "typical_torque",
            "N*m",
            1e-9,
            1e9,
            None,
            "of the drive while it moves; sets how strong an effect may be",
        ),
        Setting("typical_speed", "rad/s", 1e-6, 1e5, None, "of its motions"),
        Setting("stroke", "rad", 1e-6, 1e6, None, "range of its angles"),
        Setting("middle", "rad", -1e6, 1e6, 0.0, "middle of its angles"),
        Setting("turn", "rad", 1e-6, 1e6, 2.0 * np.pi, "of the shaft per turn of the motor"),
    ),
    links=(
        (
            Link(
                LINK,
                "shaft",
                "drive_torque_nm",
                "N*m",
                "motion to the torque that the drive must give",
            ),
            "torque",
        ),
    ),
    parameters=tuple(_parameter(row) for row in _ROWS),
    effects=(*(_effect(one) for one in carriage.COMPONENT.effects), _effect(_GRAVITY.effect)),
    prepare=prepare,
    residual=residual,
    features=features,
    undetermined=undetermined,
    turning=turning,
    effort="torque",
    needs={LINK: ("angle",)},
    equations=(
        "the carriage's, with an angle for x, an inertia for M, a torque for F, and turn for pitch",
        "weight: a sin(q) + b cos(q) beside the laws of friction",
    ),
)
