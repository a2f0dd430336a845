"""Measured states that a link's residual may depend on."""

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.evaluate import Bench


def features(bench: Bench, link: str) -> dict[str, np.ndarray]:
    """Name with unit to (n,), at the residuals' rate and through their low-pass."""
    found = {
        "drive": _drive,
        "motor": _motor,
        "torque": _motor,
        "encoder": _encoder,
        "muscle0": _muscle,
        "load": _load,
    }.get(link)
    made = _gas(bench, int(link[-1])) if found is None else found(bench)
    made["time_s"] = np.arange(bench.prepared.count) * bench.prepared.period_s
    return {
        name: smooth.at_rate(np.ascontiguousarray(values, float)) for name, values in made.items()
    }


def _motion(bench: Bench) -> dict[str, np.ndarray]:
    angle, speed, acceleration = bench.motor()
    return {
        "motor_angle_rad": angle,
        "motor_speed_rad_s": speed,
        "motor_acceleration_rad_s2": acceleration,
    }


def _drive(bench: Bench) -> dict[str, np.ndarray]:
    p = bench.prepared
    commands = p.commands
    return _motion(bench) | {
        "command_speed_rad_s": commands["target_speed_rad_s"],
        "command_angle_error_rad": np.where(
            commands["mode"] == 8, commands["target_angle_rad"] - bench.motor()[0], 0.0
        ),
        "current_a": bench.true("motor_current_a"),
    }


def _motor(bench: Bench) -> dict[str, np.ndarray]:
    p = bench.prepared
    current = bench.true("motor_current_a")
    found = _motion(bench) | {
        "current_a": current,
        "current_squared_a2": slow(current**2, p.period_s, 4.0),
    }
    if "force_n" in p.readings:
        found["force_n"] = bench.true("force_n")
    return found


def _encoder(bench: Bench) -> dict[str, np.ndarray]:
    return _motion(bench)


def _muscle(bench: Bench) -> dict[str, np.ndarray]:
    line = bench.line(0)
    return {
        "gauge_pa": bench.gauge(0),
        "length_m": line[0],
        "speed_m_s": line[1],
        "acceleration_m_s2": smooth.slope(line[1], bench.prepared.period_s),
        "motor_angle_rad": bench.motor()[0],
        "pressure_rate_pa_s": bench.prepared.smooth["muscle0_gauge_pa_slope"],
    }


def _gas(bench: Bench, i: int) -> dict[str, np.ndarray]:
    p = bench.prepared
    line = bench.line(i)
    commands = p.commands
    return {
        "gauge_pa": bench.gauge(i),
        "length_m": line[0],
        "speed_m_s": line[1],
        "pressure_rate_pa_s": p.smooth[f"muscle{i}_gauge_pa_slope"],
        "inlet_open": commands["inlet"][:, i],
        "exhaust_open": commands["exhaust"][:, i],
        "span_time_s": since(p.shut[i], p.count) * p.period_s,
        "motor_angle_rad": bench.motor()[0],
    }


def _load(bench: Bench) -> dict[str, np.ndarray]:
    place, speed, acceleration = bench.place()
    unit = "rad" if "joint_angle_rad" in bench.prepared.readings else "m"
    found = {
        f"place_{unit}": place,
        f"speed_{unit}_s": speed,
        f"acceleration_{unit}_s2": acceleration,
        "force_n": bench.modelled_force(0),
    }
    if bench.params["muscle"]["present"][0, 1] > 0.5:
        found["force1_n"] = bench.modelled_force(1)
    return found


def since(spans: np.ndarray, count: int) -> np.ndarray:
    """(N,) cycles since the last span began, 0 before the first and after each end."""
    found = np.zeros(count)
    for start, stop in spans:
        found[start:stop] = np.arange(stop - start)
    return found


def slow(values: np.ndarray, period_s: float, time_s: float) -> np.ndarray:
    """(N,) through a first-order lag, from its first value."""
    from scipy.signal import lfilter

    part = period_s / time_s
    return lfilter([part], [1.0, part - 1.0], values, zi=[(1.0 - part) * 0.0])[0]
