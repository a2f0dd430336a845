"""A position servo's joint, stepped forward: proportional drive, lag, friction, play, compliance. numba."""

import numpy as np
from numba import njit

SUBSTEPS = 8
RIGID_S2 = 1e-5         # compliance over inertia below which the joint follows stiffly
JOINT_DAMPING = 0.2     # of the compliant gear

# places in the packed numbers
GAIN, LAG, LOSS, DEADBAND, SPEED_LIMIT, TORQUE_LIMIT = 0, 1, 2, 3, 4, 5
COULOMB, STICTION, VISCOUS, BACKLASH, COMPLIANCE = 6, 7, 8, 9, 10
GRAVITY_SINE, GRAVITY_COSINE, LOAD, STEP, PLACES = 11, 12, 13, 14, 15


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
            share = dt / n[LAG]
            if speed == 0.0 and abs(push) <= n[COULOMB] + n[STICTION]:
                continue
            free = (speed + share * push) / (1.0 + share * (1.0 + n[VISCOUS]))
            held = share * n[COULOMB] / (1.0 + share * (1.0 + n[VISCOUS]))
            after = 0.0 if abs(free) <= held else (free - held if free > 0.0 else free + held)
            turned = speed * after < 0.0 and abs(push) <= n[COULOMB] + n[STICTION]
            speed = 0.0 if turned else after
            motor += dt * speed
            half = 0.5 * n[BACKLASH] if preload_rad_s[k] == 0.0 else 0.0
            if n[COMPLIANCE] > RIGID_S2:
                bent = motor - joint
                bent -= min(max(bent, -half), half)
                stiffness = 1.0 / n[COMPLIANCE]
                damping = 2.0 * JOINT_DAMPING * np.sqrt(stiffness)
                joint_speed = (joint_speed + dt * (stiffness * bent + damping * speed)) / (1.0 + dt * damping + dt * dt * stiffness)
                joint += dt * joint_speed
            else:
                joint = min(max(joint, motor - half), motor + half)
        out[k] = read
    return out
