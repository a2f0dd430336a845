"""Command logs that move every part of a plant: pre-stretch, fill, motion, vent, and the three
loops of the drive.
"""

import numpy as np

from epa_rt.models import plant
from epa_rt.models.plant_file import PlantFile
from epa_rt.models.ports import COMMAND, SENSORS

RPM = 2 * np.pi / 60
SENSOR_STEP = {
    "motor_angle_rad": 2 * np.pi / 4096,
    "motor_speed_rad_s": RPM,
    "motor_current_a": 1e-3,
    "motor_torque_nm": 1.7e-4,
    "muscle0_gauge_pa": 1200.0,
    "muscle1_gauge_pa": 1200.0,
    "supply_gauge_pa": 1200.0,
    "force_n": 0.24,
    "joint_angle_rad": np.deg2rad(0.02),
    "joint_speed_rad_s": RPM,
    "load_position_m": 1e-5,
}


def rise(t: np.ndarray, start_s: float, span_s: float) -> np.ndarray:
    """0 to 1 with zero speed and acceleration at both ends."""
    u = np.clip((t - start_s) / span_s, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u * u)


def log_commands(file: PlantFile, seconds: float, period_s: float = 1e-3) -> np.ndarray:
    """Commands, (N,) COMMAND: position loop throughout, for the bench position and speed loop in
    turns.
    """
    n = round(seconds / period_s)
    t = np.arange(n) * period_s
    commands = np.zeros(n, COMMAND)
    commands["enabled"], commands["mode"] = 1.0, 8.0
    gear = file.params["transmission"]
    per_metre = float(gear["gear_ratio"][0] / gear["spool_radius_m"][0])
    if file.name.startswith("bench"):
        commands["enabled"][:100] = 0.0
        travel = 0.018 * rise(t, 0.3, 1.0) + rise(t, 4.0, 0.5) * (
            0.006 * np.sin(2 * np.pi * 1.3 * t) + 0.004 * np.sin(2 * np.pi * 3.1 * t + 1.0)
        )
        commands["inlet"][:, 0] = (t % 20 > 2) & (t % 20 < 3.3)
        commands["exhaust"][:, 0] = (t % 20 > 16) & (t % 20 < 16.7)
        commands["mode"][(t % 20 > 9) & (t % 20 < 13)] = 9.0
    elif file.name == "knee":
        chirp = 2 * np.pi * np.cumsum(0.5 + 1.5 * t / max(t[-1], 1.0)) * period_s
        travel = 0.02 * rise(t, 0.3, 1.0) + 0.005 * rise(t, 4.0, 0.5) * np.sin(chirp)
        commands["inlet"][:, 0] = (t % 50 > 2) & (t % 50 < 2.15)
        commands["inlet"][:, 1] = (t % 50 > 1.5) & (t % 50 < 1.6)
        commands["exhaust"][:] = ((t % 50 > 47) & (t % 50 < 47.7))[:, None]
    else:
        travel = 0.003 * rise(t, 3.0, 1.0) * np.sin(60.0 * t)
        commands["inlet"][:, 0] = (t > 0.2) & (t < 1.2)
    commands["target_angle_rad"] = travel * per_metre
    commands["target_speed_rad_s"] = np.gradient(travel, period_s) * per_metre
    return commands


def silent(params: np.ndarray) -> np.ndarray:
    """A copy of the parameters without sensor noise."""
    params = params.copy()
    for name in params["sensors"].dtype.names:
        if "_noise" in name:
            params["sensors"][name] = 0.0
    return params


def simulate(params: np.ndarray, commands: np.ndarray, substeps: int) -> np.ndarray:
    """Readings of a whole log from the rest state, (N,) SENSORS."""
    out = np.zeros(len(commands), SENSORS)
    plant.run(params, plant.new_state(params), commands, 1e-3, substeps, out)
    return out
