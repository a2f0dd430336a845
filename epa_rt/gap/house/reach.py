"""Which links a number of the plant reaches, and which effects a rig can have at all."""

import numpy as np

from epa_rt.models.blocks.load import FIXED, KNEE, MASS
from epa_rt.models.effect import Effect
from epa_rt.models.knobs import row_of

_GASES = ("gas0", "gas1")
_LENGTHS = (*_GASES, "muscle0")
_DRIVE = {  # rows of the drive; others reach the drive's own loop alone
    "torque_constant_nm_a": ("drive", "motor", "torque"), "inertia_kg_m2": ("motor",), "viscous_nm_s_rad": ("motor",), "coulomb_nm": ("motor",),
    "presliding_stiffness_nm_rad": ("motor",), "presliding_time_s": ("motor",), "stribeck_ratio": ("motor",), "stribeck_speed_rad_s": ("motor",),
    "cogging_nm": ("motor", "torque"), "cogging_per_turn_ratio": ("motor", "torque"), "torque_ripple_ratio": ("motor", "torque"),
    "ripple_per_turn_ratio": ("motor", "torque"), "torque_loss_per_k": ("drive", "motor", "torque"),
    "winding_thermal_k_w": ("motor", "torque"), "winding_time_s": ("motor", "torque"), "winding_ohm": ("drive", "motor", "torque"),
}
_TRANSMISSION = {"gear_efficiency_ratio": ("motor",), "gear_friction_n": ("motor",), "backlash_rad": _LENGTHS}
_SHAPE = ("braid_length_m", "braid_turns_ratio", "end_length_m")  # of the muscle: they make its volume too
_SENSORS = (  # first part of a row's name
    ("motor_angle", ("drive", "motor", *_LENGTHS, "load", "encoder")), ("motor_speed", ("drive", "motor", *_LENGTHS, "encoder")),
    ("motor_current", ("drive", "motor", "torque")), ("motor_torque", ("torque",)), ("muscle0_gauge", ("gas0", "muscle0")),
    ("muscle1_gauge", ("gas1", "load")), ("pressure_lag", (*_GASES, "muscle0", "load")), ("force", ("muscle0", "motor", "load")),
    ("joint_", (*_LENGTHS, "load")), ("load_position", (*_LENGTHS, "load")), ("encoder_", ("drive", "motor", *_LENGTHS, "encoder")),
)


def reached(key: str, params: np.ndarray) -> tuple[str, ...]:
    """Names of links (of any rig) whose residual may change with a number of the plant ``params``."""
    block, row, muscle = row_of(key)
    kind, both = float(params["load"]["kind_code"][0]), params["muscle"]["present"][0, 1] > 0.5
    gases = _GASES if muscle is None else (f"gas{muscle}",)
    if block == "bus":
        return ("drive",) if row.name.startswith("command") else _GASES
    if block == "drive":
        return _DRIVE.get(row.name, ("drive",))
    if block == "transmission":
        return _TRANSMISSION.get(row.name, ("motor", *_LENGTHS))
    if block == "gas":
        return gases
    if block == "muscle":
        found = () if muscle == 1 else ("muscle0",)
        found += gases if row.name in (*_SHAPE, "strap_compliance_m_n") else ()
        return found + (("load",) if both and muscle != 0 else ())
    if block == "load":
        lengths = row.name in ("lever_m", "lever_slope_per_rad") or row.name.startswith(("rest", "travel", "load"))
        return (("load",) if kind != FIXED else ()) + (_LENGTHS if lengths and (kind == KNEE or row.name != "lever_m") else ())
    found = next((links for start, links in _SENSORS if row.name.startswith(start)), ())
    return found if both or not row.name.startswith("pressure_lag") else tuple(link for link in found if link != "load")


def applies(effect: Effect, params: np.ndarray) -> bool:
    """Whether a plant of this kind can have the effect."""
    kind = float(params["load"]["kind_code"][0])
    if effect.block != "load":
        return True
    rows = {row_of(key)[1].name for key in effect.knobs}
    if rows & {"coulomb_n", "guide_stiffness_n_m"}:
        return kind == MASS
    if rows & {"knee_coulomb_nm", "knee_stiffness_nm_rad", "misalignment_rad", "lever_slope_per_rad"}:
        return kind == KNEE
    return kind != FIXED
