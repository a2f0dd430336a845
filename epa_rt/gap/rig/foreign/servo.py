"""A hobby servo's joint: commanded angle to measured angle, the only sensor at the joint.

Everything acts on this one channel, so much of the catalogue looks alike; what sets it apart is the
menu of experiments.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.rig.foreign import servo_model as model
from epa_rt.gap.rig.foreign.component import (
    Channel,
    Component,
    Experiment,
    Numbers,
    Parameter,
    Setting,
    effect,
)
from epa_rt.gap.rig.foreign.signals import Signals, shifted
from epa_rt.gap.subject import Link

LINK = ("position",)
RATE_HZ = 50.0
PLACE = {
    "joint.gain_per_s": model.GAIN,
    "joint.lag_s": model.LAG,
    "drive.gain_loss_ratio": model.LOSS,
    "drive.deadband_rad": model.DEADBAND,
    "drive.speed_limit_s_rad": model.SPEED_LIMIT,
    "drive.torque_limit_s_rad": model.TORQUE_LIMIT,
    "friction.coulomb_rad_s": model.COULOMB,
    "friction.stiction_rad_s": model.STICTION,
    "friction.viscous_ratio": model.VISCOUS,
    "gear.backlash_rad": model.BACKLASH,
    "gear.compliance_s2": model.COMPLIANCE,
    "load.gravity_sine_rad_s": model.GRAVITY_SINE,
    "load.gravity_cosine_rad_s": model.GRAVITY_COSINE,
    "load.constant_rad_s": model.LOAD,
    "sensor.step_rad": model.STEP,
    "gear.beyond_ratio": model.BEYOND,
    "friction.forward_rad_s": model.FORWARD,
    "friction.backward_rad_s": model.BACKWARD,
    "drive.ignored_rad": model.IGNORED,
}


@dataclass(frozen=True)
class Prepared:
    signals: Signals
    command_rad: np.ndarray
    gain_ratio: np.ndarray
    preload_rad_s: np.ndarray
    start_rad: float


def prepare(signals: Signals, numbers: Numbers) -> Prepared:
    """Command, rad, factor of the gain and preload, rad/s (1 and 0 where the log has none), (N,)
    each; starts at the first angle measured, else commanded.
    """
    columns, count = signals.columns, signals.samples
    start = (
        columns["position"]
        if "position" in columns and signals.valid["position"].any()
        else columns["command"]
    )
    return Prepared(
        signals,
        columns["command"],
        columns.get("gain_ratio", np.ones(count)),
        columns.get("preload", np.zeros(count)),
        float(start[0]),
    )


def free_run(prepared: Prepared, n: Numbers) -> Mapping[str, np.ndarray]:
    """The joint from commands alone; the loop is closed, so it does not drift away."""
    command = prepared.command_rad - n["sensor.zero_rad"]
    delay = n["drive.delay_s"] * prepared.signals.rate_hz + n["clock.row_ratio"]
    if delay != 0.0:
        command = shifted(command, delay)
    period_s = 1.0 / prepared.signals.rate_hz
    if n["drive.profile_s2_rad"] > 0.0:
        plan = n["drive.profile_s2_rad"], n["drive.profile_s_rad"]
        command = model.profiled(command, *plan, float(command[0]), period_s)
    packed = np.zeros(model.PLACES)
    for key, place in PLACE.items():
        packed[place] = n[key]
    scale = 1.0 + n["sensor.scale_ratio"]
    angle = model.run(
        command,
        prepared.gain_ratio,
        prepared.preload_rad_s,
        packed,
        prepared.start_rad / scale,
        period_s,
    )
    return {"position": angle * scale}


def residual(prepared: Prepared, numbers: Numbers, link: str) -> np.ndarray:
    """(N,) measured angle less that of ``free_run``, rad, at the log's rate, unfiltered."""
    return prepared.signals.columns["position"] - free_run(prepared, numbers)["position"]


def features(prepared: Prepared, link: str) -> Mapping[str, np.ndarray]:
    """(N,) each, at the log's rate: command, rad, its low-passed speed, rad/s, measured angle, rad.
    Raises ValueError where ``lowpass`` does.
    """
    signals = prepared.signals
    speed = signals.slope(signals.lowpass(prepared.command_rad))
    return {
        "command_rad": prepared.command_rad,
        "command_speed_rad_s": speed,
        "position_rad": signals.columns["position"],
    }


def menu(settings: Numbers) -> tuple[Experiment, ...]:
    """Commanded profiles, also with the servo's gain doubled and with a weight on the joint."""
    stroke = settings["stroke"]
    found = []
    for name, says, command in _profiles(stroke):
        for gain, load in ((1.0, 0.0), (2.0, 0.0), (0.5, 0.0), (1.0, 0.3)):
            said = {
                "amplitude": f"{stroke:g} rad",
                "position_gain": f"{gain:g} x",
                "weight": f"{load:g} rad/s of the motor's speed",
            }
            extra = (" with another gain of the servo" if gain != 1.0 else "") + (
                " with a weight that keeps the gear on one flank" if load else ""
            )
            found.append(
                Experiment(
                    name,
                    said,
                    says + extra,
                    RATE_HZ,
                    {
                        "command": command,
                        "gain_ratio": np.full(len(command), gain),
                        "preload": np.full(len(command), load),
                    },
                )
            )
    return tuple(found)


def _profiles(stroke: float) -> tuple[tuple[str, str, np.ndarray], ...]:
    time = np.arange(0.0, 40.0, 1.0 / RATE_HZ)
    triangle = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * time / 8.0))
    swept = np.sin(2 * np.pi * (0.2 * time + 0.5 * (2.0 - 0.2) / 40.0 * time**2))
    sizes = np.repeat([1.0, 0.5, 0.25, 0.12, 0.06], len(time) // 5)
    steps = np.repeat(
        np.tile([1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.1, -0.1, 0.0, 0.0], 2), len(time) // 20
    )
    return (
        ("slow_triangle", "slow strokes", 0.5 * stroke * triangle),
        (
            "shrinking_strokes",
            "strokes that shrink",
            0.5 * stroke * sizes * np.sin(2 * np.pi * time / 2.0),
        ),
        ("steps", "steps of many sizes with rests", 0.5 * stroke * steps),
        ("chirp", "a sweep of frequency", 0.25 * stroke * swept),
    )


def _p(
    key: str,
    unit: str,
    of: str | None,
    low: float,
    high: float,
    spread: float,
    neutral: float | None = 0.0,
) -> Parameter:
    return Parameter(key, unit, neutral, low, high, spread, LINK, of)


_ROWS = (
    _p("joint.gain_per_s", "1/s", None, 0.1, 1e3, 0.2, None),
    _p("joint.lag_s", "s", None, 1e-3, 5.0, 0.3, None),
    Parameter("sensor.zero_rad", "rad", None, -0.1, 0.1, 0.01, LINK, absolute=True),
    # A loop that reads before it commands logs an angle that its row's command has not moved yet.
    Parameter("clock.row_ratio", "1", 0.0, 0.0, 1.0, 0.5, LINK, absolute=True),
    _p("drive.gain_loss_ratio", "1", "gain_loss", -2.0, 0.95, 0.2),
    _p("drive.deadband_rad", "rad", "deadband", 0.0, 0.5, 0.01),
    _p("drive.ignored_rad", "rad", "deadband_whole", 0.0, 0.5, 0.01),
    _p("drive.delay_s", "s", "delay", 0.0, 0.5, 0.02),
    _p("drive.speed_limit_s_rad", "s/rad", "speed_limit", 0.0, 20.0, 0.2),
    _p("drive.torque_limit_s_rad", "s/rad", "torque_limit", 0.0, 20.0, 0.2),
    _p("drive.profile_s2_rad", "s^2/rad", "profile", 0.0, 5.0, 0.05),
    _p("drive.profile_s_rad", "s/rad", "profile", 0.0, 20.0, 0.5),
    _p("friction.coulomb_rad_s", "rad/s", "coulomb", 0.0, 10.0, 0.1),
    _p("friction.stiction_rad_s", "rad/s", "stiction", 0.0, 10.0, 0.1),
    _p("friction.forward_rad_s", "rad/s", "friction_by_direction", 0.0, 10.0, 0.1),
    _p("friction.backward_rad_s", "rad/s", "friction_by_direction", 0.0, 10.0, 0.1),
    _p("friction.viscous_ratio", "1", "viscous", -0.9, 10.0, 0.2),
    _p("gear.backlash_rad", "rad", "backlash", 0.0, 0.3, 0.01),
    _p("gear.compliance_s2", "s^2", "gear_compliance", 0.0, 0.1, 1e-3),
    _p("gear.beyond_ratio", "1", "gear_compliance", 0.0, 0.9, 0.3, neutral=0.3),
    _p("load.gravity_sine_rad_s", "rad/s", "gravity", -20.0, 20.0, 0.2),
    _p("load.gravity_cosine_rad_s", "rad/s", "gravity", -20.0, 20.0, 0.2),
    _p("load.constant_rad_s", "rad/s", "constant_load", -20.0, 20.0, 0.2),
    _p("sensor.step_rad", "rad", "encoder_step", 0.0, 0.1, 5e-3),
    _p("sensor.scale_ratio", "1", "sensor_scale", -0.5, 1.0, 0.02),
)


def _e(
    name: str,
    family: str,
    block: str,
    starts: tuple[tuple[float, ...], ...],
    says: str,
    equation: str,
    source: str,
    sets_in: bool = False,
):
    return effect(
        name,
        family,
        block,
        tuple(row.key for row in _ROWS if row.effect == name),
        starts,
        says,
        equation,
        source,
        sets_in=sets_in,
    )


def _close(
    typical: float, ratio: float, below: int, above: int, digits: int
) -> tuple[tuple[float], ...]:
    """Starts of one number: a typical one, and so many below and above, each a ratio apart."""
    return tuple(
        (round(typical * ratio**i, digits),) for i in (0, *range(-below, 0), *range(1, above + 1))
    )


# of a servo that plans its motion: 0.6 to 200 rad/s^2, and no speed, or 5, 2 and 0.8 rad/s
_PROFILES = (
    (0.05, 0.5),
    *((round(0.005 * 1.7**i, 4), speed) for i in range(11) for speed in (0.0, 0.2, 0.5, 1.2)),
)
# A limit does nothing until it is below the largest speed that the logs ask for, gain times error:
# 0.3 to 17 rad/s by stroke and servo. A fit finds it from where it bites and from not far below
# what it is, so that starts stand close over all of that; 5 rad/s, a hobby servo's, is the typical
# one.
_LIMITS = _close(0.2, 1.3, 9, 11, 3)
# What a servo does at rest jumps with these: a slope leads only a little way.
_IGNORED = _close(0.01, 1.25, 4, 9, 5)
_BREAKS = _close(0.1, 1.25, 7, 12, 4)

_EFFECTS = (
    _e(
        "backlash",
        "backlash",
        "gear",
        ((0.01,), (0.03,)),
        "a gap in the gear",
        "q = play(q_motor, b)",
        "STS3215 data sheet; SO-ARM100 reports",
    ),
    _e(
        "coulomb",
        "friction",
        "friction",
        ((0.1,), (0.5,)),
        "dry friction of motor and gear",
        "T dw/dt = K e - w - c sgn(w)",
        "Coulomb",
    ),
    _e(
        "friction_by_direction",
        "friction",
        "friction",
        ((0.1, 0.0), (0.0, 0.1), (0.5, 0.2), (0.2, 0.5)),
        "dry friction that differs by direction",
        "T dw/dt = K e - w - c+ where w > 0, + c- where w < 0",
        "Armstrong-Helouvry 1994",
    ),
    _e(
        "stiction",
        "stiction",
        "friction",
        _BREAKS,
        "break-away above sliding friction",
        "rest while |K e| < c + s",
        "Stribeck",
        sets_in=True,
    ),
    _e(
        "viscous",
        "gain",
        "friction",
        ((0.2,), (-0.2,)),
        "drag beyond the motor's own",
        "T dw/dt = K e - (1 + d) w",
        "grease",
    ),
    _e(
        "gain_loss",
        "gain",
        "drive",
        ((0.2,), (-0.2,)),
        "a servo gain that is lost",
        "K -> K (1 - l)",
        "battery voltage, heat",
    ),
    _e(
        "deadband",
        "deadband",
        "drive",
        ((0.01,), (0.03,)),
        "the servo ignores small errors",
        "e -> e - clip(e, -d, d)",
        "STS3215 registers 26, 27",
    ),
    _e(
        "deadband_whole",
        "deadband",
        "drive",
        _IGNORED,
        "the servo ignores small errors and answers larger ones in full",
        "e -> 0 while |e| < d",
        "a relay with a dead zone",
        sets_in=True,
    ),
    _e(
        "delay",
        "delay",
        "drive",
        ((0.02,), (0.06,)),
        "commands arrive late",
        "u(t - T)",
        "half-duplex bus",
    ),
    _e(
        "speed_limit",
        "limit",
        "drive",
        _LIMITS,
        "a motor that runs no faster (inverse of the speed)",
        "|K e| <= 1/s",
        "supply voltage",
        sets_in=True,
    ),
    _e(
        "torque_limit",
        "limit",
        "drive",
        _LIMITS,
        "a torque that saturates (inverse of the speed it would drive)",
        "|K e - w| <= 1/s",
        "current limit",
        sets_in=True,
    ),
    _e(
        "profile",
        "limit",
        "drive",
        _PROFILES,
        "a servo that plans its own motion, by an acceleration and a speed (inverses of both)",
        "u -> r, |r''| <= 1/s2, |r'| <= 1/s, so that r stops at u",
        "registers of acceleration and speed of bus servos",
        sets_in=True,
    ),
    _e(
        "gear_compliance",
        "compliance",
        "gear",
        ((1e-3, 0.3), (5e-3, 0.3), (2e-4, 0.3)),
        "a gear that winds up, part of the mass beyond it",
        "q'' = (q_motor - q)/c + damping, (1 - r) T dw/dt = K e - w - r T q''",
        "plastic gear; two-mass drive",
    ),
    _e(
        "gravity",
        "load",
        "load",
        ((0.2, 0.0), (0.0, 0.2)),
        "weight of what hangs on the joint",
        "a sin(q) + b cos(q)",
        "arm pose",
    ),
    _e(
        "constant_load",
        "offset",
        "load",
        ((0.2,), (-0.2,)),
        "a constant load",
        "K e - L",
        "spring, cable",
    ),
    _e(
        "encoder_step",
        "encoder_step",
        "sensor",
        ((5e-3,),),
        "an encoder coarser than said",
        "q_read = round(q/s) s",
        "encoder",
    ),
    _e(
        "sensor_scale",
        "sensor",
        "sensor",
        ((0.02,), (-0.02,)),
        "an angle whose scale in the log is not the one the servo's own loop closes on",
        "q_read = (1 + s) q",
        "units, gear ratio in a logger",
    ),
)

EQUATIONS = (
    (
        f"{model.SUBSTEPS} steps dt to a row, from rest at the first angle read; w: the motor's"
        " speed, q: the joint's angle; forces count as the speed that they take from the motor and"
        " act in the middle of a step, half of which w goes before them and half after"
    ),
    (
        "u: command less zero, late by delay + row * period (cubic interpolation); with a profile u"
        " -> r, which reaches u as soon as |r''| <= 1/s2 and |r'| <= 1/s allow, to stop there; e ="
        " u - round(q/step) step; e -> 0 while |e| < ignored, else e - clip(e, -d, d)"
    ),
    (
        "drive = K (1 - loss) gain_ratio e, drive -> drive / max(1, |drive| s); push = drive - a"
        " sin(q) - b cos(q) - L - preload, push -> w + (push - w) / max(1, |push - w| s)"
    ),
    (
        "rigid gear: T dw/dt = push - (1 + d) w - dry sgn(w), exact over a step of constant push,"
        " dry = c + c+ or c-; at rest while |push| <= dry + stiction; q follows the motor within"
        " b/2 (b = 0 under a preload)"
    ),
    (
        f"a compliance c above {model.RIGID_S2:g} s^2, {model.WOUND * model.SUBSTEPS} steps: q'' ="
        f" bent/c + {2 * model.JOINT_DAMPING:g} / sqrt(c) (w - q'); bent = motor - q less what the"
        " gap takes, (1 - r) T dw/dt = push - ... - r T q'', implicit midpoint"
    ),
    (
        "residual = angle - (1 + scale) round(q/step) step at the row's end, low-passed and thinned"
        " out; the same is the free run"
    ),
)

COMPONENT = Component(
    kind="servo",
    says="a servo's joint: commanded and measured angle",
    channels=(
        Channel("command", "rad", "commanded angle", size="stroke"),
        Channel("position", "rad", "measured angle", size="stroke"),
        Channel(
            "gain_ratio",
            "1",
            "the servo's gain over its usual one, where an experiment changes it",
            False,
        ),
        Channel("preload", "rad/s", "a weight on the joint, as motor speed that it takes", False),
    ),
    settings=(Setting("stroke", "rad", 1e-3, 10.0, None, "of the experiments that may come next"),),
    links=(
        (
            Link("position", "joint", "joint_position_rad", "rad", "command to the joint's angle"),
            "position",
        ),
    ),
    parameters=_ROWS,
    effects=_EFFECTS,
    prepare=prepare,
    residual=residual,
    features=features,
    free_run=free_run,
    menu=menu,
    needs={"position": ("command",)},
    output_is_foreseen=True,
    equations=EQUATIONS,
)
