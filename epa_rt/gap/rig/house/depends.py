"""Which parameter records a result depends on, so that it is made once for all that leave them
alone.
"""

from collections.abc import Callable

import numpy as np

from epa_rt.models.parameters import PARAMS

LOAD = (
    "kind_code",
    "rest0_m",
    "rest1_m",
    "travel0_ratio",
    "travel1_ratio",
    "load0_ratio",
    "load1_ratio",
    "lever_m",
    "lever_slope_per_rad",
    "lever_curve_per_rad2",
)
SHAPE = (
    "braid_length_m",
    "braid_turns_ratio",
    "end_length_m",
)  # of the muscle: they make its volume too
NOT_OF_GAS = ("seed", "force_", "frame_", "motor_current_", "motor_torque_")  # of the sensors' rows
MOTION = ("motor_", "joint_", "load_", "encoder_")  # first part of the sensors' rows
# of the drive's rows: they make a current of a torque
NOT_OF_TORQUE = ("cogging_", "torque_", "ripple_", "winding_", "housing_")


def _rows(block: str, wanted: Callable[[str], bool]) -> tuple[str, ...]:
    """Names of a block's rows that are wanted."""
    return tuple(name for name in PARAMS[block].names if wanted(name))


_OF_LENGTHS = _rows("sensors", lambda name: name.startswith(MOTION) and "noise" not in name)
_OF_PRESSURES = _rows(
    "sensors", lambda name: not name.startswith(NOT_OF_GAS) and "noise" not in name
)
_OF_TORQUE = _rows("drive", lambda name: not name.startswith(NOT_OF_TORQUE))


def lengths(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes lengths of lines out of readings."""
    sensors = params["sensors"][0]
    own = [np.asarray(sensors[name]) for name in _OF_LENGTHS]
    return (params["transmission"], *(params["load"][name] for name in LOAD), *own)


def gases(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes pressures of lengths and commands, and forces of both."""
    return (*lengths(params), params["gas"], params["muscle"], params["bus"], params["sensors"])


def torques(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes the torque on the shaft of measured motion, pressures and forces."""
    return (*gases(params), *(params["drive"][name] for name in _OF_TORQUE))


def pressures(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes pressures of lengths and commands: of the muscle only its shape, but where forces
    have a part in it.
    """
    sensors = params["sensors"][0]
    if (
        np.any(params["muscle"]["strap_compliance_m_n"] != 0.0)
        or sensors["gauge_crosstalk_pa_n"] != 0.0
    ):
        return gases(params)
    own = [np.asarray(sensors[name]) for name in _OF_PRESSURES]
    return (
        *lengths(params),
        params["gas"],
        params["bus"],
        *(params["muscle"][name] for name in ("present", *SHAPE)),
        *own,
    )
