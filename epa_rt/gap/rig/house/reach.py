"""Which links a number of the plant reaches, and which effects a rig can have at all."""

from collections.abc import Collection

import numpy as np

from epa_rt.gap.rig.house.depends import SHAPE
from epa_rt.models.blocks.load import FIXED, KNEE, MASS
from epa_rt.models.effect import Effect
from epa_rt.models.knobs import row_of
from epa_rt.models.tables_load import CHANNELS, split

_GASES = ("gas0", "gas1")
_LENGTHS = (*_GASES, "muscle0")
_MOTOR = ("motor", "torque")
_DRIVE = {  # rows of the drive; others reach the drive's own loop alone
    "torque_constant_nm_a": ("drive", *_MOTOR),
    "torque_loss_per_k": ("drive", *_MOTOR),
    "winding_ohm": ("drive", *_MOTOR),
    "housing_heat_ratio": ("drive", *_MOTOR),
    "housing_time_s": ("drive", *_MOTOR),
} | dict.fromkeys(
    (
        "inertia_kg_m2",
        "viscous_nm_s_rad",
        "coulomb_nm",
        "viscous_asymmetry_ratio",
        "friction_wave_ratio",
        "friction_wave_per_turn_ratio",
        "friction_wave_phase_rad",
        "presliding_stiffness_nm_rad",
        "presliding_time_s",
        "stribeck_ratio",
        "stribeck_speed_rad_s",
        "stribeck_exponent_ratio",
        "cogging_nm",
        "cogging_per_turn_ratio",
        "cogging_phase_rad",
        "cogging_twice_sine_ratio",
        "cogging_twice_cosine_ratio",
        "torque_ripple_ratio",
        "ripple_per_turn_ratio",
        "ripple_phase_rad",
        "ripple_twice_sine_ratio",
        "ripple_twice_cosine_ratio",
        "torque_saturation_per_a",
        "winding_thermal_k_w",
        "winding_time_s",
    ),
    _MOTOR,
)
_TRANSMISSION = {
    "gear_efficiency_ratio": _MOTOR,
    "gear_friction_n": _MOTOR,
    "gear_friction_speed_rad_s": _MOTOR,
    "gear_friction_sharpness_ratio": _MOTOR,
    "gear_sliding_ratio": _MOTOR,
    "backlash_rad": _LENGTHS,
    "backlash_roundness_ratio": _LENGTHS,
    "uneven_backlash_rad": _LENGTHS,
    "backlash_wave_ratio": _LENGTHS,
    "backlash_per_turn_ratio": _LENGTHS,
    "backlash_narrowness_ratio": _LENGTHS,
    "backlash_phase_rad": _LENGTHS,
}
_SENSORS = (  # first part of a row's name, longer ones first
    ("motor_angle", ("drive", *_MOTOR, *_LENGTHS, "encoder")),
    ("motor_speed", ("drive", *_MOTOR, *_LENGTHS, "encoder")),
    ("motor_current", ("drive", *_MOTOR)),
    ("motor_torque", ("torque",)),
    ("muscle0_gauge", ("gas0", "muscle0")),
    ("muscle1_gauge", ("gas1", "load")),
    ("pressure_lag", (*_GASES, "muscle0", "load")),
    ("gauge_crosstalk", ("gas0", "muscle0")),
    ("gauge_", (*_GASES, "muscle0", "load")),
    ("force", ("muscle0", *_MOTOR, "load")),
    ("frame_", ("muscle0", *_MOTOR, "load")),
    ("joint_", (*_LENGTHS, "load")),
    ("load_position", (*_LENGTHS, "load")),
    ("encoder_skew", ("drive", *_MOTOR, *_LENGTHS)),
    ("encoder_", ("drive", *_MOTOR, *_LENGTHS, "encoder")),
)
_OF_A_KNEE = ("inertia_kg_m2", "mass_lever_m", "lever_m", "viscous_nm_s_rad", "payload_lever_ratio")
_STEMS = tuple((split(channel)[0], channel) for channel, _ in CHANNELS)


def reached(key: str, params: np.ndarray, ports: Collection[str]) -> tuple[str, ...]:
    """Names of links (of any rig) whose residual may change with a number of the plant; ``ports``
    are those the rig shows.

    A load is moved by the forces that pressures and lengths make, so that what reaches those
    reaches its link.
    """
    found = _reached(key, params, ports)
    if params["load"]["kind_code"][0] == FIXED:
        return tuple(link for link in found if link != "load")
    cell = row_of(key)[1].name.startswith(("force", "frame_")) and "muscle0_gauge_pa" in ports
    if cell:
        return tuple(link for link in found if link != "load")
    return (
        (*found, "load")
        if "load" not in found and not {*_GASES, "muscle0"}.isdisjoint(found)
        else found
    )


def _reached(key: str, params: np.ndarray, ports: Collection[str]) -> tuple[str, ...]:
    block, row, muscle = row_of(key)
    kind, both = float(params["load"]["kind_code"][0]), params["muscle"]["present"][0, 1] > 0.5
    gases = _GASES if muscle is None else (f"gas{muscle}",)
    if block == "bus":
        return ("drive",) if row.name.startswith("command") else _GASES
    if block == "drive":
        return _DRIVE.get(row.name, ("drive",))
    if block == "transmission":
        return _TRANSMISSION.get(row.name, (*_MOTOR, *_LENGTHS))
    if block == "gas":
        return gases
    if block == "muscle":
        found = () if muscle == 1 else ("muscle0",)
        found += (
            gases if row.name in (*SHAPE, "strap_compliance_m_n", "strap_stiffening_per_n") else ()
        )
        return found + (("load",) if both and muscle != 0 else ())
    if block == "load":
        if (kind == KNEE and row.name == "viscous_n_s_m") or (
            kind == MASS and row.name in _OF_A_KNEE
        ):
            return ()
        lengths = row.name.startswith(("lever", "rest", "travel", "load"))
        return (("load",) if kind != FIXED else ()) + (
            _LENGTHS if lengths and (kind == KNEE or row.name != "lever_m") else ()
        )
    stem = next((channel for stem, channel in _STEMS if row.name.startswith(f"{stem}_")), None)
    if (stem is not None and stem not in ports) or (
        row.name.startswith("joint_") and "joint_angle_rad" not in ports
    ):
        return ()
    return next((links for start, links in _SENSORS if row.name.startswith(start)), ())


def applies(effect: Effect, params: np.ndarray) -> bool:
    """Whether a plant of this kind can have the effect."""
    kind = float(params["load"]["kind_code"][0])
    if effect.block != "load":
        return True
    rows = {row_of(key)[1].name for key in effect.knobs}
    if rows & {"coulomb_n", "guide_stiffness_n_m"}:
        return kind == MASS
    if rows & {
        "knee_coulomb_nm",
        "knee_stiffness_nm_rad",
        "knee_spring_nm_rad",
        "misalignment_rad",
        "lever_slope_per_rad",
    }:
        return kind == KNEE
    return kind != FIXED
