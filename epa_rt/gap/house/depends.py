"""Which parameter records a result depends on, so that it is made once for all that leave them alone."""

import numpy as np

LOAD = ("kind_code", "rest0_m", "rest1_m", "travel0_ratio", "travel1_ratio", "load0_ratio", "load1_ratio", "lever_m", "lever_slope_per_rad")
MOTION = ("motor_", "joint_", "load_", "encoder_")   # first part of the sensors' rows


def lengths(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes lengths of lines out of readings."""
    sensors = params["sensors"][0]
    own = [np.asarray(sensors[name]) for name in sensors.dtype.names if name.startswith(MOTION) and "noise" not in name]
    return (params["transmission"], *(params["load"][name] for name in LOAD), *own)


def gases(params: np.ndarray) -> tuple[np.ndarray, ...]:
    """What makes pressures of lengths and commands, and forces of both."""
    return (*lengths(params), params["gas"], params["muscle"], params["bus"], params["sensors"])
