"""One point of a study: a plant, its pressures and a sine; what the motor does for it and what that
costs.
"""

from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from epa_rt.study import servo_loop as loop

PID = (10.0, 50.0, 0.12)  # the paper's: kp, ki (1/s), kd (s)
LAG_S = 1e-3
STEP_S = 1e-4
LEAST_SETTLE_S, SETTLE_PERIODS, MEASURED_PERIODS = 2.0, 12, 4
RUNAWAY_M = 0.1


@dataclass(frozen=True)
class Drive:
    """The servo of a study: PID (kp, ki 1/s, kd s) on the load coordinate, lag of the travel (s),
    step of the integrator (s).

    Figures are taken after ``settle_periods``, at least LEAST_SETTLE_S.
    """

    pid: tuple[float, float, float] = PID
    lag_s: float = LAG_S
    step_s: float = STEP_S
    settle_periods: int = SETTLE_PERIODS


@dataclass(frozen=True)
class Found:
    """What a sine took, over MEASURED_PERIODS after settling; NaN where the load ran away.

    Strokes are peak to peak. ``peak_power_w`` is the peak of |F v| at the spool (the paper's "peak
    power" is read as this shaft power), ``peak_electric_w`` of R I^2 + k I w at the winding, for
    the plant's own motor and gear with friction and inertia. ``energy_a2_s`` is eq. (9), the
    integral of I^2 over one period. Tension, pressure and length are muscle 0's.
    """

    stroke_m: float
    motion_m: float
    error_m: float
    peak_power_w: float
    peak_electric_w: float
    energy_a2_s: float
    peak_current_a: float
    tension_mean_n: float
    tension_low_n: float
    tension_high_n: float
    pressure_low_pa: float
    pressure_high_pa: float
    length_high_m: float
    runaway_s: float

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


NAMES = tuple(field.name for field in fields(Found))


def trace(
    params: np.ndarray,
    no_load_pa: tuple[float, float],
    mean: float,
    amplitude_m: float,
    omega_rad_s: float,
    drive: Drive = Drive(),
    travel_range_m: tuple[float, float] = (-0.15, 0.15),
) -> tuple[np.ndarray, float]:
    """The settled periods as rows (N, servo_loop.COLUMNS) and the time of a run-away (s, 0 if
    none).

    ``no_load_pa`` absolute, of both muscles; ``mean`` place of the load (m or rad); ``amplitude_m``
    along the load coordinate.
    """
    from epa_rt.models.ports import STATE

    load = params["load"][0]
    state, pressures = np.zeros(1, STATE), np.asarray(no_load_pa, float)
    start = loop.balance(params, state, pressures, mean, *travel_range_m)
    state[:] = np.zeros(1, STATE)
    loop.fill(params, state, pressures, mean, start)
    period = 2.0 * np.pi / omega_rad_s
    settle = max(LEAST_SETTLE_S, drive.settle_periods * period)
    keep_from = round(np.ceil(settle / period) * period / drive.step_s)
    steps = keep_from + round(MEASURED_PERIODS * period / drive.step_s) + 1
    every = max(1, round(period / drive.step_s / 400))
    out = np.zeros((1 + (steps - keep_from) // every, loop.COLUMNS))
    direction = -1.0 if load["travel0_ratio"] * load["load0_ratio"] > 0.0 else 1.0
    lever = float(load["lever_m"]) if load["kind_code"] == 2.0 else 1.0
    wave = (mean * lever, amplitude_m, float(omega_rad_s), min(0.5, 0.25 * settle))
    rows, ran = loop.simulate(
        params,
        state,
        wave,
        (*map(float, drive.pid), direction, start, drive.lag_s),
        drive.step_s,
        steps,
        keep_from,
        every,
        RUNAWAY_M,
        out,
    )
    return out[:rows], ran


def measure(params: np.ndarray, rows: np.ndarray, ran_s: float) -> Found:
    """The figures of a trace."""
    if ran_s or len(rows) < 10 or not np.isfinite(rows).all():
        return replace(Found(*[float("nan")] * len(NAMES)), runaway_s=ran_s)
    place, travel, speed = rows[:, loop.PLACE], rows[:, loop.TRAVEL], rows[:, loop.TRAVEL_SPEED]
    force = spool_force(params, rows)
    current, motor_speed = winding(params, rows)
    drive = params["drive"][0]
    electric = (
        drive["winding_ohm"] * current**2 + drive["torque_constant_nm_a"] * current * motor_speed
    )
    seconds = rows[-1, loop.TIME] - rows[0, loop.TIME]
    tension, pressure = rows[:, loop.FORCE0], rows[:, loop.PRESSURE0]
    return Found(
        float(np.ptp(travel)),
        float(np.ptp(place)),
        float(np.sqrt(np.mean((rows[:, loop.REFERENCE] - place) ** 2))),
        float(np.abs(force * speed).max()),
        float(np.abs(electric).max()),
        float(np.trapezoid(current**2, rows[:, loop.TIME]) / seconds * seconds / MEASURED_PERIODS),
        float(np.abs(current).max()),
        float(tension.mean()),
        float(tension.min()),
        float(tension.max()),
        float(pressure.min()),
        float(pressure.max()),
        float(rows[:, loop.LENGTH0].max()),
        0.0,
    )


def spool_force(params: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Force of both muscles against positive travel (N), (N,)."""
    load = params["load"][0]
    return (
        rows[:, loop.FORCE0] * load["travel0_ratio"] + rows[:, loop.FORCE1] * load["travel1_ratio"]
    )


def winding(params: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Winding current (A) and motor speed (rad/s), (N,), that the travel takes of the plant's own
    motor, gear and friction.
    """
    from epa_rt.models.blocks.motor import motor_over_log

    gear = params["transmission"][0]
    ratio = gear["gear_ratio"] / gear["spool_radius_m"]
    period = float(np.mean(np.diff(rows[:, loop.TIME])))
    motor_speed = rows[:, loop.TRAVEL_SPEED] * ratio
    current = motor_over_log(
        params,
        rows[:, loop.TRAVEL] * ratio,
        motor_speed,
        np.gradient(motor_speed, period),
        spool_force(params, rows),
        period,
    )
    return current, motor_speed


def point(
    params: np.ndarray,
    no_load_pa: tuple[float, float],
    mean: float,
    amplitude_m: float,
    omega_rad_s: float,
    drive: Drive = Drive(),
) -> Found:
    """``measure`` of ``trace``."""
    return measure(params, *trace(params, no_load_pa, mean, amplitude_m, omega_rad_s, drive))
