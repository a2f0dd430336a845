"""Which parameter records a result depends on, so that it is made once for all that leave them
alone.
"""

import numpy as np

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


def lengths(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes lengths of lines out of readings."""
    sensors = params["sensors"][0]
    own = [
        np.asarray(sensors[name])
        for name in sensors.dtype.names
        if name.startswith(MOTION) and "noise" not in name
    ]
    return (params["transmission"], *(params["load"][name] for name in LOAD), *own)


def gases(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes pressures of lengths and commands, and forces of both."""
    return (*lengths(params), params["gas"], params["muscle"], params["bus"], params["sensors"])


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
    own = [
        np.asarray(sensors[name])
        for name in sensors.dtype.names
        if not name.startswith(NOT_OF_GAS) and "noise" not in name
    ]
    return (
        *lengths(params),
        params["gas"],
        params["bus"],
        *(params["muscle"][name] for name in ("present", *SHAPE)),
        *own,
    )
