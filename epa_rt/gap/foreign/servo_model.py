"""A position servo's joint, stepped forward: proportional drive, lag, friction, play, compliance. numba."""

import numpy as np
from numba import njit

SUBSTEPS = 8
RIGID_S2 = 1e-5         # compliance over inertia below which the joint follows stiffly
JOINT_DAMPING = 0.2     # of the compliant gear

# places in the packed numbers
GAIN, LAG, LOSS, DEADBAND, SPEED_LIMIT, TORQUE_LIMIT = 0, 1, 2, 3, 4, 5
COULOMB, STICTION, VISCOUS, BACKLASH, COMPLIANCE = 6, 7, 8, 9, 10
GRAVITY_SINE, GRAVITY_COSINE, LOAD, STEP, BEYOND = 11, 12, 13, 14, 15
FORWARD, BACKWARD, PLACES = 16, 17, 18


@njit(cache=True, nogil=True)
def run(command_rad: np.ndarray, gain_ratio: np.ndarray, preload_rad_s: np.ndarray, n: np.ndarray, start_rad: float, period_s: float) -> np.ndarray:
    """Joint angle (N,), rad, as its encoder reads it, for commands (N,) each.

    Forces count as the speed that they take from the motor: gain and friction cannot be told in newton metres from
    angles alone. The encoder sits on the joint and closes the loop. A preload keeps the gap shut.
    """
    out = np.empty(len(command_rad))
    dt = period_s / SUBSTEPS
    motor, speed, joint, joint_speed, read = start_rad, 0.0, start_rad, 0.0, start_rad
    for k in range(len(command_rad)):
        for _ in range(SUBSTEPS):
            read = joint if n[STEP] <= 0.0 else np.floor(joint / n[STEP] + 0.5) * n[STEP]
            error = command_rad[k] - read
            error -= min(max(error, -n[DEADBAND]), n[DEADBAND])
            drive = n[GAIN] * (1.0 - n[LOSS]) * gain_ratio[k] * error
            if n[SPEED_LIMIT] > 0.0:
                drive = drive / max(1.0, abs(drive) * n[SPEED_LIMIT])
            push = drive - n[GRAVITY_SINE] * np.sin(joint) - n[GRAVITY_COSINE] * np.cos(joint) - n[LOAD] - preload_rad_s[k]
            if n[TORQUE_LIMIT] > 0.0:
                push = speed + (push - speed) / max(1.0, abs(push - speed) * n[TORQUE_LIMIT])
            half = 0.5 * n[BACKLASH] if preload_rad_s[k] == 0.0 else 0.0
            if n[COMPLIANCE] > RIGID_S2:
                speed, joint_speed = _wound(speed, joint_speed, motor - joint, half, push, dt, n)
                motor += dt * speed
                joint += dt * joint_speed
            else:
                speed = _slid(speed, push, 1.0, dt / n[LAG], n)
                motor += dt * speed
                joint = min(max(joint, motor - half), motor + half)
        out[k] = read
    return out


@njit(cache=True, nogil=True)
def _slid(base: float, push: float, mass: float, share: float, n: np.ndarray) -> float:
    """The motor's speed after a step of the lag's ``share``, implicit: ``mass`` that it moves over the whole one, ``base`` its speed before times that mass."""
    dry = n[COULOMB] + (n[FORWARD] if push > 0.0 else n[BACKWARD])
    held_at_rest = abs(push) <= dry + n[STICTION]
    if base == 0.0 and held_at_rest:
        return 0.0
    drag = mass + share * (1.0 + n[VISCOUS])
    free = (base + share * push) / drag
    held = share * (n[COULOMB] + (n[FORWARD] if free > 0.0 else n[BACKWARD])) / drag
    after = 0.0 if abs(free) <= held else (free - held if free > 0.0 else free + held)
    return 0.0 if base * after < 0.0 and held_at_rest else after


@njit(cache=True, nogil=True)
def _wound(speed: float, joint_speed: float, bent: float, half: float, push: float, dt: float, n: np.ndarray) -> tuple[float, float]:
    """Speeds of motor and joint after a step with a gear that winds up. The part of the mass beyond the gear pulls back on the motor; both are taken implicitly."""
    bent -= min(max(bent, -half), half)
    stiffness = 1.0 / n[COMPLIANCE]
    along = dt * (dt * stiffness + 2.0 * JOINT_DAMPING * np.sqrt(stiffness))
    share, beyond = dt / n[LAG], n[BEYOND]
    pull = (dt * stiffness * bent - along * joint_speed) / (1.0 + along)
    speed = _slid((1.0 - beyond) * speed, push - beyond * pull / share, 1.0 - beyond + beyond * along / (1.0 + along), share, n)
    return speed, (joint_speed + dt * stiffness * bent + along * speed) / (1.0 + along)
