"""A position servo's joint, stepped forward: proportional drive, lag, friction, play, compliance.
numba.
"""

import numpy as np
from numba import njit

SUBSTEPS = 8
WOUND = 2  # times as many where the gear winds up: its gap opens and shuts within a step
RIGID_S2 = 1e-5  # compliance over inertia below which the joint follows stiffly
JOINT_DAMPING = 0.2  # of the compliant gear

# of a planned motion: from its command it is as good as there, and parts of it within a row at most
ARRIVED_RAD, PHASES = 1e-9, 6

# places in the packed numbers
GAIN, LAG, LOSS, DEADBAND, SPEED_LIMIT, TORQUE_LIMIT = 0, 1, 2, 3, 4, 5
COULOMB, STICTION, VISCOUS, BACKLASH, COMPLIANCE = 6, 7, 8, 9, 10
GRAVITY_SINE, GRAVITY_COSINE, LOAD, STEP, BEYOND = 11, 12, 13, 14, 15
FORWARD, BACKWARD, IGNORED, PLACES = 16, 17, 18, 19


@njit(cache=True, nogil=True)
def run(
    command_rad: np.ndarray,
    gain_ratio: np.ndarray,
    preload_rad_s: np.ndarray,
    n: np.ndarray,
    start_rad: float,
    period_s: float,
) -> np.ndarray:
    """Joint angle (N,), rad, as its encoder reads it at every row's end, for commands (N,) each.

    Forces count as the speed that they take from the motor: gain and friction cannot be told in
    newton metres from angles alone. The encoder sits on the joint and closes the loop. A preload
    keeps the gap shut. Forces act in the middle of a step, the lag is exact with a rigid gear and
    an implicit midpoint with one that winds up: errors go with the step's square.
    """
    out = np.empty(len(command_rad))
    winds = n[COMPLIANCE] > RIGID_S2
    steps = SUBSTEPS * (WOUND if winds else 1)
    dt = period_s / steps
    share, drag = dt / n[LAG], 1.0 + n[VISCOUS]
    kept = np.exp(-share * drag)
    taken = (1.0 - kept) / drag
    torque_limit = n[TORQUE_LIMIT] / (
        1.0 + 0.5 * share if winds else share / (1.0 - np.exp(-share))
    )  # of the push that takes this torque over the whole step
    sticks = n[COULOMB] + n[STICTION] + n[FORWARD] + n[BACKWARD] > 0.0
    hangs = n[GRAVITY_SINE] != 0.0 or n[GRAVITY_COSINE] != 0.0  # else zero times whatever it is
    gear = _gear(0.5 * dt, n) if winds else (0.0, 0.0, 0.0, 0.0)
    motor, speed, joint, joint_speed = start_rad, 0.0, start_rad, 0.0
    for k in range(len(command_rad)):
        half = 0.5 * n[BACKLASH] if preload_rad_s[k] == 0.0 else 0.0
        for _ in range(steps):
            middle = joint + 0.5 * dt * joint_speed
            if not winds:
                motor += 0.5 * dt * speed
                middle = joint = min(max(joint, motor - half), motor + half)
            error = command_rad[k] - _read(middle, n)
            error = (
                0.0
                if abs(error) < n[IGNORED]
                else error - min(max(error, -n[DEADBAND]), n[DEADBAND])
            )
            drive = n[GAIN] * (1.0 - n[LOSS]) * gain_ratio[k] * error
            if n[SPEED_LIMIT] > 0.0:
                drive = drive / max(1.0, abs(drive) * n[SPEED_LIMIT])
            sine, cosine = (np.sin(middle), np.cos(middle)) if hangs else (middle, middle)
            push = (
                drive
                - n[GRAVITY_SINE] * sine
                - n[GRAVITY_COSINE] * cosine
                - n[LOAD]
                - preload_rad_s[k]
            )
            if n[TORQUE_LIMIT] > 0.0:
                push = speed + (push - speed) / max(1.0, abs(push - speed) * torque_limit)
            if winds:
                mean, joint_mean = _wound(speed, joint_speed, motor - joint, half, push, gear, n)
                motor += dt * mean
                joint += dt * joint_mean
                speed, joint_speed = (
                    (0.0 if sticks and mean * (2.0 * mean - speed) <= 0.0 else 2.0 * mean - speed),
                    2.0 * joint_mean - joint_speed,
                )
            else:
                speed = _slid(kept * speed, push, taken, n)
                motor += 0.5 * dt * speed
                joint = min(max(joint, motor - half), motor + half)
        out[k] = _read(joint, n)
    return out


@njit(cache=True, nogil=True)
def profiled(
    command_rad: np.ndarray, s2_rad: float, s_rad: float, start_rad: float, period_s: float
) -> np.ndarray:
    """What a servo that plans its own motion follows, (N,), rad: the command, reached as soon as an
    acceleration and a speed allow, whose inverses are ``s2_rad`` and ``s_rad`` (0: any speed).

    Exact for a command that is held over each row.
    """
    out = np.empty(len(command_rad))
    most = 1.0 / s2_rad
    fastest = 1.0 / s_rad if s_rad > 0.0 else np.inf
    place, speed = start_rad, 0.0
    for k in range(len(command_rad)):
        time = period_s
        for _ in range(PHASES):
            # where it would come to rest if it braked now is short of the command on this side
            short = command_rad[k] - place - 0.5 * speed * abs(speed) * s2_rad
            side = 1.0 if short > 0.0 else -1.0
            way, pace = side * (command_rad[k] - place), side * speed
            if abs(short) <= ARRIVED_RAD:
                by, takes = -np.sign(speed) * most, abs(speed) * s2_rad
            elif pace < fastest:
                by = side * most
                takes = (np.sqrt(max(0.5 * pace * pace + most * way, 0.0)) - pace) * s2_rad
                takes = min(takes, (fastest - pace) * s2_rad)
            else:
                by, takes = 0.0, (way - 0.5 * pace * pace * s2_rad) / pace
            takes = min(max(takes, 0.0), time)
            place += takes * (speed + 0.5 * takes * by)
            speed += takes * by
            time -= takes
            if time <= 0.0:
                break
        out[k] = place
    return out


@njit(cache=True, nogil=True)
def _read(joint: float, n: np.ndarray) -> float:
    return joint if n[STEP] <= 0.0 else np.floor(joint / n[STEP] + 0.5) * n[STEP]


@njit(cache=True, nogil=True)
def _slid(coasting: float, push: float, taken: float, n: np.ndarray) -> float:
    """The motor's speed after a step: that of ``coasting``, and of push less dry friction the part
    that the motor has ``taken`` on by then.
    """
    dry = n[COULOMB] + (n[FORWARD] if push > 0.0 else n[BACKWARD])
    held_at_rest = abs(push) <= dry + n[STICTION]
    if coasting == 0.0 and held_at_rest:
        return 0.0
    free = coasting + taken * push
    held = taken * (n[COULOMB] + (n[FORWARD] if free > 0.0 else n[BACKWARD]))
    after = 0.0 if abs(free) <= held else (free - held if free > 0.0 else free + held)
    return 0.0 if coasting * after < 0.0 and held_at_rest else after


@njit(cache=True, nogil=True)
def _gear(dt: float, n: np.ndarray) -> tuple[float, float, float, float]:
    """Of ``dt`` with a gear that winds up: what its bend and its speed push the joint by, the part
    of a push that the motor takes on, and what divides its speed.
    """
    stiffness = 1.0 / n[COMPLIANCE]
    along = dt * (dt * stiffness + 2.0 * JOINT_DAMPING * np.sqrt(stiffness))
    share, beyond = dt / n[LAG], n[BEYOND]
    drag = 1.0 - beyond + beyond * along / (1.0 + along) + share * (1.0 + n[VISCOUS])
    return dt * stiffness, along, share, drag


@njit(cache=True, nogil=True)
def _wound(
    speed: float,
    joint_speed: float,
    bent: float,
    half: float,
    push: float,
    gear: tuple[float, float, float, float],
    n: np.ndarray,
) -> tuple[float, float]:
    """Speeds of motor and joint at the end of the time of ``gear``. The part of the mass beyond the
    gear pulls back on the motor; both are taken implicitly.
    """
    stiff, along, share, drag = gear
    bent -= min(max(bent, -half), half)
    beyond = n[BEYOND]
    pull = (stiff * bent - along * joint_speed) / (1.0 + along)
    speed = _slid((1.0 - beyond) * speed / drag, push - beyond * pull / share, share / drag, n)
    return speed, (joint_speed + stiff * bent + along * speed) / (1.0 + along)
