"""Residuals of the links of this house's rigs, before their low-pass: measured minus predicted,
instruments imitated.
"""

from collections.abc import Callable

import numpy as np

from epa_rt.gap.rig.house import instruments, load_link, motion, motor_link, smooth
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.models.ports import STATE

# Of the current behind the torque reading, the part taken from the motion's balance, the rest from
# the current reading: so the current's noise, which the motor link has too, is not counted twice.
NEEDED = 0.75
# Two poles on the load's balance: a measured acceleration is noise that grows with the frequency
# squared, which would bury how well slow motion is known. Behind them a converter's steps are white
# noise above this, and below it the forces' noise rules.
LOAD_HZ = 4.0
ABSURD = 1e12  # stands for a prediction that is no number


def drive_residual(bench: Bench) -> np.ndarray:
    """(N,) current reading less what the drive's loop makes of commands and measured motion, A."""
    p = bench.prepared
    angle, speed, _ = bench.motor()
    out = np.empty(p.count)
    measured = bench.true("motor_current_a")
    motor_link.drive_current(
        bench.params,
        np.zeros(1, STATE),
        p.commands,
        angle,
        speed,
        measured,
        p.led,
        bench.warmth(),
        p.period_s,
        out,
    )
    return p.readings["motor_current_a"] - bench.shown("motor_current_a", out)


def motor_residual(bench: Bench) -> np.ndarray:
    """(N,) current reading less what the measured motion and the muscles' forces need, A."""
    return bench.prepared.readings["motor_current_a"] - bench.shown(
        "motor_current_a", _needed_current(bench)
    )


def _needed_current(bench: Bench) -> np.ndarray:
    """(N,) current that the measured motion needs against the muscles' forces, A: made once for the
    two links that are held against it.
    """

    def made() -> np.ndarray:
        out = np.empty(bench.prepared.count)
        motor_link.current_for(
            bench.params, bench.needed_torque(), bench.motor()[0], bench.warmth(), out
        )
        return out

    return bench.kept("current", (bench.params,), made)


def torque_residual(bench: Bench) -> np.ndarray:
    """(N,) torque reading less torque constant times current (NEEDED of it from the motion's
    balance), N*m.
    """
    current = NEEDED * _needed_current(bench) + (1.0 - NEEDED) * bench.true("motor_current_a")
    seen = bench.shown("motor_current_a", current)  # all that the drive knows of its torque
    reported = float(bench.params["drive"]["torque_constant_nm_a"][0]) * seen
    return bench.prepared.readings["motor_torque_nm"] - bench.shown("motor_torque_nm", reported)


def encoder_residual(bench: Bench) -> np.ndarray:
    """(N,) speed reading less the slope of the angle reading, what the encoder does taken off,
    rad/s.
    """
    p = bench.prepared
    out = np.empty(p.count)
    motion.true_angle(bench.sensors, p.renewed["motor_angle_rad"], bench.zero(), 1.0, out)
    return p.renewed["motor_speed_rad_s"] - bench.shown(
        "motor_speed_rad_s", smooth.slope(out, p.period_s)
    )


def gas_residual(bench: Bench, i: int) -> np.ndarray:
    """(N,) gauge reading of muscle i less what valves and measured lengths make of its gas, Pa."""
    _, seen = bench.pressure(i)
    port = f"muscle{i}_gauge_pa"
    gauge = instruments.moved(
        seen - float(bench.params["gas"]["atmosphere_pa"][0, i]), -bench.cycles("gauge_skew_s")
    )
    if (
        i == 0
        and bench.sensors["gauge_crosstalk_pa_n"] != 0.0
        and "force_n" in bench.prepared.readings
    ):
        gauge = gauge + float(bench.sensors["gauge_crosstalk_pa_n"]) * bench.force(0)
    return bench.prepared.readings[port] - bench.shown(port, gauge)


def muscle_residual(bench: Bench) -> np.ndarray:
    """(N,) reading of the force cell less the force of muscle 0 from measured pressure and length,
    N.
    """
    predicted = bench.predicted_force(0)
    if instruments.is_dynamic(bench.sensors):
        predicted = predicted + bench.late_part()
    if bench.sensors["force_crosstalk_n_pa"] != 0.0:
        predicted = predicted + float(bench.sensors["force_crosstalk_n_pa"]) * bench.gauge(0)
    return bench.prepared.readings["force_n"] - bench.shown("force_n", predicted)


def load_residual(bench: Bench) -> np.ndarray:
    """(N,) the load's acceleration less what the muscles' forces give it, behind two poles at
    LOAD_HZ, rad/s^2 or m/s^2.
    """
    p = bench.prepared
    place, speed, _ = bench.place()
    out = np.empty(p.count)
    load_link.load_acceleration(
        bench.params,
        place,
        speed,
        bench.modelled_force(0),
        bench.modelled_force(1),
        p.period_s,
        out,
    )
    port = bench.place_port()
    out = instruments.moved(
        out, -bench.cycles("joint_skew_s") if port == "joint_angle_rad" else 0.0
    )
    return smooth.two_poles(
        p.smooth["place_acceleration"] - instruments.line_of(bench.sensors, port)[0] * out,
        LOAD_HZ,
        p.period_s,
    )


def at_rate(raw: np.ndarray, judged: np.ndarray) -> np.ndarray:
    """(n,) a residual (N,) behind its low-pass, NaN where it is not judged."""
    found = smooth.at_rate(raw)
    found[~np.isfinite(found)] = ABSURD
    found[~judged] = np.nan
    return found


RESIDUALS: dict[str, Callable[[Bench], np.ndarray]] = {
    "drive": drive_residual,
    "motor": motor_residual,
    "gas0": lambda b: gas_residual(b, 0),
    "gas1": lambda b: gas_residual(b, 1),
    "muscle0": muscle_residual,
    "load": load_residual,
    "encoder": encoder_residual,
    "torque": torque_residual,
}
