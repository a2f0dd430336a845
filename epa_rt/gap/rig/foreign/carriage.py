"""A carriage on a screw or belt behind a motor: position and what the drive was told, held together
by a force balance.

The link ``force`` compares the drive's force (its controller's output times its gain) with what the
measured motion asks for; every term passes the same zero-phase low-pass, and a position that is
differentiated passes it before. Below the low-pass all frequencies weigh alike, as in
identification by inverse dynamics (IDIM-LS): a filter that whitens what laps differ by would rest
on reversals and jolts, where errors of timing and of differentiated positions are largest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from epa_rt.gap.rig.foreign.component import Channel, Component, Numbers, Parameter, Setting, effect
from epa_rt.gap.rig.foreign.law import (
    LINK,
    REST_RATIO,
    Law,
    Motion,
    either_way,
    kept,
    motion,
    sloped_otherwise,
)
from epa_rt.gap.rig.foreign.moved import smoothed
from epa_rt.gap.rig.foreign.operators import carried, swung
from epa_rt.gap.rig.foreign.rests import at_rest
from epa_rt.gap.rig.foreign.reversals import REVERSALS, Turning, turning_of
from epa_rt.gap.rig.foreign.signals import Signals, lagged, shifted
from epa_rt.gap.rig.foreign.terms import LAWS, in_contact, motion_features, stray_force_n
from epa_rt.gap.subject import Link

# of the stroke, a typical one first: a fit finds one that it begins near to, for a load that hits a
# wall at another moment is far off
GAPS = (2e-3, *np.geomspace(2e-4, 3e-2, 24).tolist())
# waves on the way at the least, or one to the rig file's turn where that is longer. By definition:
# what a log does not show twice is not seen to return, and is a curve over the place as a spring's
SEEN_TWICE = 2.0
# s for a radian of a load's own swing, 40 Hz to 4 Hz, a typical one first
LAGS_S = (8e-3, *np.geomspace(4e-3, 4e-2, 9).tolist())


@dataclass(frozen=True)
class Prepared:
    """``force_n``: of the drive, as measured; ``base``: the motion of the position as it was read;
    ``turned_rad``: of the motor, by it.
    """

    signals: Signals
    force_n: np.ndarray
    base: Motion
    turned_rad: np.ndarray


def _motion(
    position_m: np.ndarray, read_m: np.ndarray, filtered: bool, rate_hz: float, n: Numbers
) -> Motion:
    return motion(
        position_m, read_m, rate_hz, n["typical_speed"], n["middle"], n["stroke"], filtered
    )


def prepare(signals: Signals, numbers: Numbers) -> Prepared:
    """The drive's force as measured, N, and the motion of the low-passed position, m, m/s, m/s^2,
    (N,) each. Raises ValueError where ``lowpass`` does.
    """
    position_m, filtered = smoothed(signals, numbers)
    read_m = signals.columns["position"]
    base = _motion(position_m, read_m, filtered, signals.rate_hz, numbers)
    return Prepared(signals, signals.columns["force"], base, _turned_rad(base, numbers))


def residual(
    prepared: Prepared, numbers: Numbers, link: str, laws: Sequence[Law] = LAWS
) -> np.ndarray:
    """(N,) the drive's force less what ``numbers`` ask of it by EQUATIONS, N, at the log's rate,
    unfiltered. ``laws``: of friction and stray forces.
    """
    return prepared.force_n - _through_drive(
        needed_n(_true_motion(prepared, numbers), numbers, laws), prepared.signals, numbers
    )


def needed_n(m: Motion, n: Numbers, laws: Sequence[Law] = LAWS) -> np.ndarray:
    """Force that a motion asks of the drive, (N,), N; nobody may change it."""
    m = in_contact(m, n)
    total = kept(_but_cogging_n, m, n, laws)
    if n["drive.cogging_n"] != 0.0:
        total = total + _wave(m, n, "drive.cogging")
    return total


def _but_cogging_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> np.ndarray:
    inertia_n = n["carriage.inertia_kg"] * m.read_acceleration_m_s2
    drag_n = n["friction.viscous_n_s_m"] * m.read_speed_m_s
    total = inertia_n + drag_n + kept(_beside_drag_n, m, n, laws)
    if n["drive.backlash_m"] != 0.0:
        total = total + kept(_through_gap_n, m, n, laws)
    if n["drive.coupling_lag_s"] != 0.0:
        total = total + kept(_through_spring_n, m, n, laws)
    return total


def _beside_drag_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> np.ndarray:
    """Force of all laws of friction and stray forces, (N,), N."""
    force_n = kept(_but_wave_n, m, n, laws)
    if n["friction.turn_n"] != 0.0:
        force_n = force_n + m.sign * kept(_wave, m, n, "friction.turn")
    return force_n


def _but_wave_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> np.ndarray:
    force_n = stray_force_n(m, n, laws)
    if n["friction.load_ratio"] != 0.0:
        load_n = n["carriage.inertia_kg"] * np.abs(m.acceleration_m_s2)
        force_n = force_n + n["friction.load_ratio"] * load_n * m.sign
    return force_n


def _through_gap_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> np.ndarray:
    """Force, (N,), N, by which the walls of a gap move what is beyond it, less what the same would
    ask for without one. Beyond it are a part of the mass, a part of friction and drag, and
    whatever else pulls.
    """
    load = _load(m, n, laws, "drive.backlash")
    walls_m_s2 = carried(m.position_m, m.period_s, n["drive.backlash_m"], *load.slowed_by)
    return load.mass_kg * (walls_m_s2 - m.acceleration_m_s2) - load.taken_n


def _through_spring_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> np.ndarray:
    """As ``_through_gap_n``, by a spring that moves what is behind it."""
    load = _load(m, n, laws, "drive.coupling")
    lag_s, damping = n["drive.coupling_lag_s"], n["drive.coupling_damping_ratio"]
    spring_m_s2 = swung(
        m.speed_m_s, m.acceleration_m_s2, m.period_s, lag_s, damping, *load.slowed_by
    )
    return load.mass_kg * (spring_m_s2 - m.acceleration_m_s2) - load.taken_n


class _Load(NamedTuple):
    """What is beyond a gap or a spring. ``slowed_by``: over its mass, what pulls it back, (N,), and
    dry friction, (N,), m/s^2, and drag, 1/s; ``taken_n``: (N,) what a rigid drive gives for these.
    """

    mass_kg: float
    slowed_by: tuple[np.ndarray, np.ndarray, float]
    taken_n: np.ndarray


def _load(m: Motion, n: Numbers, laws: Sequence[Law], of: str) -> _Load:
    on, back = _either_way_n(m, n, laws)
    pull_n, dry_n = 0.5 * (on + back), 0.5 * (on - back)
    part, drag_n_s_m = n[f"{of}_friction_ratio"], n["friction.viscous_n_s_m"]
    mass_kg = n[f"{of}_load_ratio"] * n["carriage.inertia_kg"]
    slowed_by = (
        pull_n / mass_kg,
        part * np.maximum(dry_n, 0.0) / mass_kg,
        part * drag_n_s_m / mass_kg,
    )
    return _Load(mass_kg, slowed_by, part * (dry_n * m.sign + drag_n_s_m * m.speed_m_s) + pull_n)


def _either_way_n(m: Motion, n: Numbers, laws: Sequence[Law]) -> tuple[np.ndarray, np.ndarray]:
    """Force of all laws of friction and stray forces, (N,), N, on the way there and back."""
    on, back = (kept(_but_wave_n, way, n, laws) for way in either_way(m, n))
    if n["friction.turn_n"] != 0.0:
        wave_n = kept(_wave, m, n, "friction.turn")
        on, back = on + wave_n, back - wave_n
    return on, back


def _wave(m: Motion, n: Numbers, of: str) -> np.ndarray:
    """A force, (N,), N, that returns some number of times to every turn of the motor."""
    turned = n[f"{of}_periods"] * kept(_turned_rad, m, n) + n[f"{of}_phase_rad"]
    swing: np.ndarray = n[f"{of}_n"] * np.sin(turned)
    return swing


def _turned_rad(m: Motion, n: Numbers) -> np.ndarray:
    """Angle of the motor from the middle of the way on, (N,), rad."""
    return 2.0 * np.pi * (m.position_m - n["middle"]) / n["pitch"]


def _true_motion(prepared: Prepared, n: Numbers) -> Motion:
    sine, cosine = n["sensor.eccentric_sine_m"], n["sensor.eccentric_cosine_m"]
    if sine == 0.0 and cosine == 0.0:
        return prepared.base
    return kept(_centred, prepared.base, n, prepared.signals.rate_hz)


def _centred(m: Motion, n: Numbers, rate_hz: float) -> Motion:
    """The motion of a place that was read by an eccentric sensor."""
    sine, cosine = n["sensor.eccentric_sine_m"], n["sensor.eccentric_cosine_m"]
    turn = 2 * np.pi * m.position_m / n["sensor.eccentric_pitch_m"]
    wrong_m = sine * np.sin(turn) + cosine * np.cos(turn)
    return _motion(m.position_m - wrong_m, m.read_m - wrong_m, m.filtered, rate_hz, n)


def _through_drive(force_n: np.ndarray, signals: Signals, n: Numbers) -> np.ndarray:
    """What the drive must be told for that force, as a force at its nominal gain."""
    if n["drive.asymmetry_ratio"] != 0.0:  # of what noise makes of the mass' own, no size is told
        force_n = force_n + n["drive.asymmetry_ratio"] * np.abs(signals.lowpass(force_n))
    if n["drive.lag_s"] != 0.0:
        force_n = force_n + n["drive.lag_s"] * signals.slope(force_n)
    if n["drive.delay_s"] != 0.0 or n["clock.row_ratio"] != 0.0:
        force_n = shifted(force_n, -n["drive.delay_s"] * signals.rate_hz - n["clock.row_ratio"])
    return force_n / n["drive.gain_ratio"]


def at_load(left_n: np.ndarray, signals: Signals, numbers: Numbers) -> np.ndarray:
    """(N,) a residual, as the drive's force has it behind its lag.

    What the drive is told is the force that is needed and T times its slope, which makes noise of
    the place the louder the longer the lag. Behind the lag it is as loud as without one.
    """
    lag_s = numbers["drive.lag_s"]
    return left_n if lag_s == 0.0 else lagged(left_n, lag_s * signals.rate_hz)


def turning(prepared: Prepared, numbers: Numbers, laws: Sequence[Law] = LAWS) -> Turning:
    """The motion of the position as it was read; dry friction at the drive, and what the rows tell
    no better of its force, (N,), N.
    """
    m, gain = prepared.base, numbers["drive.gain_ratio"]
    on, back = _either_way_n(m, numbers, laws)
    unsure_n = needed_n(m, numbers, laws) - needed_n(sloped_otherwise(m), numbers, laws)
    return turning_of(prepared.signals, m, 0.5 * (on - back) / gain, unsure_n / gain, numbers)


def undetermined(prepared: Prepared, numbers: Numbers) -> np.ndarray:
    """(N,) bool: rows in which the carriage stands still (rests.py)."""
    return at_rest(prepared.signals, prepared.base.speed_m_s, numbers)


def features(prepared: Prepared, link: str) -> Mapping[str, np.ndarray]:
    """(N,) each, at the log's rate: place, speed and acceleration of the low-passed position, m,
    m/s, m/s^2, and turn of the motor, rad.
    """
    return motion_features(prepared.base) | {"motor_turn_rad": prepared.turned_rad}


def _p(
    key: str,
    unit: str,
    of: str | None,
    low: float,
    high: float,
    spread: float,
    scale: str = "",
    neutral: float | None = 0.0,
    low_scale: str = "",
) -> Parameter:
    return Parameter(key, unit, neutral, low, high, spread, LINK, of, scale, low_scale=low_scale)


_OWN = (
    _p("carriage.inertia_kg", "kg", None, 1e-4, 1e5, 0.05, neutral=None),
    _p("friction.viscous_n_s_m", "N*s/m", None, 0.0, 1e6, 0.3, neutral=None),
    # What stands in one row need not be of one moment: a force that a controller holds from row to
    # row acts half a period later, one that is logged before it is sent a whole one more.
    Parameter("clock.row_ratio", "1", 0.0, -1.5, 1.5, 0.5, LINK, absolute=True),
    _p("friction.load_ratio", "1", "load_friction", -0.5, 0.5, 0.05),
    _p("drive.backlash_m", "m", "backlash", 0.0, 0.05, 2e-3, "stroke"),
    _p("drive.backlash_load_ratio", "1", "backlash", 0.05, 1.0, 0.2, neutral=0.5),
    _p("drive.backlash_friction_ratio", "1", "backlash", 0.0, 1.0, 0.2, neutral=0.95),
    _p("drive.coupling_lag_s", "s", "coupling", 0.0, 0.05, 2e-3),
    _p("drive.coupling_load_ratio", "1", "coupling", 0.05, 1.0, 0.2, neutral=0.5),
    _p("drive.coupling_damping_ratio", "1", "coupling", 1e-3, 0.5, 0.1, neutral=0.1),
    _p("drive.coupling_friction_ratio", "1", "coupling", 0.0, 1.0, 0.2, neutral=0.5),
    _p("drive.cogging_n", "N", "cogging", -1.0, 1.0, 0.05, "typical_force"),
    _p(
        "drive.cogging_periods",
        "1",
        "cogging",
        SEEN_TWICE,
        200.0,
        0.01,
        neutral=1.0,
        low_scale="pitch/stroke",
    ),
    _p("drive.cogging_phase_rad", "rad", "cogging", -20.0, 20.0, 0.3),
    _p("friction.turn_n", "N", "friction_over_turn", -1.0, 1.0, 0.1, "typical_force"),
    _p(
        "friction.turn_periods",
        "1",
        "friction_over_turn",
        SEEN_TWICE,
        200.0,
        0.01,
        neutral=1.0,
        low_scale="pitch/stroke",
    ),
    _p("friction.turn_phase_rad", "rad", "friction_over_turn", -20.0, 20.0, 0.3),
    _p("drive.asymmetry_ratio", "1", "drive_asymmetry", -0.5, 0.5, 0.05),
    _p("drive.lag_s", "s", "drive_lag", 0.0, 0.05, 1e-3),
    _p("drive.delay_s", "s", "drive_delay", -0.02, 0.02, 1e-3),
    _p("drive.gain_ratio", "1", "drive_gain", 0.3, 3.0, 0.05, neutral=1.0),
    _p("sensor.eccentric_sine_m", "m", "sensor_eccentricity", -0.05, 0.05, 2e-3, "pitch"),
    _p("sensor.eccentric_cosine_m", "m", "sensor_eccentricity", -0.05, 0.05, 2e-3, "pitch"),
    _p(
        "sensor.eccentric_pitch_m", "m", "sensor_eccentricity", 0.5, 2.0, 0.05, "pitch", neutral=1.0
    ),
)
_EFFECTS = (
    effect(
        "load_friction",
        "load_friction",
        "friction",
        ("friction.load_ratio",),
        ((0.05,), (-0.05,)),
        "friction that grows with the load of acceleration",
        "F = mu |M a| sgn(v)",
        "screw and gear efficiency",
    ),
    effect(
        "friction_over_turn",
        "friction_over_turn",
        "friction",
        ("friction.turn_n", "friction.turn_periods", "friction.turn_phase_rad"),
        ((0.1, 1.0, 0.0), (0.1, 1.0, 0.5 * np.pi), (0.1, 2.0, 0.0)),
        "dry friction that returns with every turn, or some other number of times to it",
        "F = A sin(n 2 pi (x - middle)/pitch + phase) sgn(v)",
        "bearings and seals out of true; a gear's wave",
        swings_over="motor_turn_rad",
    ),
    effect(
        "backlash",
        "backlash",
        "drive",
        ("drive.backlash_m", "drive.backlash_load_ratio", "drive.backlash_friction_ratio"),
        tuple((gap, share, rubs) for rubs in (0.95, 0.2) for gap in GAPS for share in (0.5, 0.8)),
        "a gap between motor and carriage: after a reversal the motor runs light",
        "r M a -> r M y'', the load y between walls at x - b/2 and x + b/2",
        "lost motion of screw nuts; inelastic impacts in a gap",
        sets_in=True,
    ),
    effect(
        "coupling",
        "coupling",
        "drive",
        (
            "drive.coupling_lag_s",
            "drive.coupling_load_ratio",
            "drive.coupling_damping_ratio",
            "drive.coupling_friction_ratio",
        ),
        tuple((lag_s, share, 0.3, 0.5) for lag_s in LAGS_S for share in (0.5, 0.8)),
        "a shaft, belt or coupling that gives: the load swings behind the motor",
        "r M a -> r M y'', y'' = (x - y)/T^2 + 2 D (x' - y')/T less friction of the load",
        "two masses on a spring; belts, flexible joints",
        sets_in=True,
    ),
    effect(
        "cogging",
        "cogging",
        "drive",
        ("drive.cogging_n", "drive.cogging_periods", "drive.cogging_phase_rad"),
        ((0.05, 1.0, 0.0), (0.05, 1.0, 0.5 * np.pi), (0.05, 2.0, 0.0)),
        "a force that returns with every turn, or some other number of times to it",
        "F = A sin(n 2 pi (x - middle)/pitch + phase)",
        "detent torque; belt teeth, magnets of a linear motor",
        swings_over="motor_turn_rad",
    ),
    effect(
        "drive_asymmetry",
        "drive",
        "drive",
        ("drive.asymmetry_ratio",),
        ((0.05,), (-0.05,)),
        "an amplifier whose gain differs by sign",
        "F -> F + d |F|",
        "half-bridge mismatch",
    ),
    effect(
        "drive_lag",
        "delay",
        "drive",
        ("drive.lag_s",),
        ((1e-3,),),
        "a drive whose force follows late: a jerk term",
        "T dF/dt + F = u",
        "current loop",
    ),
    effect(
        "drive_delay",
        "delay",
        "drive",
        ("drive.delay_s",),
        ((1e-3,), (-1e-3,)),
        "dead time between output and force, or clocks that are apart",
        "F(t) = u(t - T)",
        "sampling",
    ),
    effect(
        "drive_gain",
        "gain",
        "drive",
        ("drive.gain_ratio",),
        ((1.05,), (0.95,)),
        "a drive gain that is not the one said",
        "F = r u",
        "calibration",
    ),
    effect(
        "sensor_eccentricity",
        "sensor",
        "sensor",
        ("sensor.eccentric_sine_m", "sensor.eccentric_cosine_m", "sensor.eccentric_pitch_m"),
        ((2e-3, 0.0, 1.0), (0.0, 2e-3, 1.0)),
        "an encoder disc off its centre",
        "x = x_read - A sin(2 pi x/p) - B cos(2 pi x/p)",
        "encoder mounting",
    ),
)

EQUATIONS = (
    (
        "x: the place as read, low-passed, less A sin(2 pi x/p) + B cos(2 pi x/p); v and a: slopes"
        " of x at the log's rate, of fourth order where x has nothing above a quarter of it"
    ),
    (
        "x is low-passed at 4 or 2 times the rig file's cut-off or at it, the first behind which"
        " noise is little: below 0.003 of v_typical in v and 0.006 of the typical force in M a,"
        " low-passed"
    ),
    (
        f"sgn(v) = v / sqrt(v^2 + (r v_typical)^2), r = {REST_RATIO:g}; place along the way X = (x"
        " - middle) / (stroke/2); turn of the motor 2 pi (x - middle) / pitch"
    ),
    (
        "F = M a + B v + D + A sin(n turn + phase), D = laws of friction + (mu |M a| + A sin(n turn"
        " + phase)) sgn(v), the numbers of either wave its own; M a and B v of the place as read,"
        " by slopes of sixth order"
    ),
    (
        "with a backlash b: F -> F + r M (c - a) - f (B v + dry friction) - the rest of D, c what a"
        " wall accelerates the load y by; between the walls r M y'' is minus these three, of y'; at"
        " a wall y = x - b/2 or x + b/2; y begins in the middle, at rest"
    ),
    (
        "with a coupling: the same with c = y'' + what slows the load down, y'' = (x - y)/T^2 + 2 D"
        " (x' - y')/T less that: a spring carries the load, exactly from row to row"
    ),
    (
        "F -> F + d |F low-passed|, F -> F + T dF/dt, F(t) -> F(t + delay + row * period) by cubic"
        " interpolation, F -> F / gain: each where it is not neutral, in this order"
    ),
    *REVERSALS,
    (
        "residual = force - F, through the lag where there is one, low-passed and thinned out to"
        " the rig file's rate"
    ),
)

COMPONENT = Component(
    kind="carriage",
    says="a motor that drives a carriage: position and the force asked of the drive",
    channels=(
        Channel("position", "m", "measured place of the carriage", size="stroke"),
        Channel("force", "N", "controller's output times the drive's gain", size="typical_force"),
    ),
    settings=(
        Setting(
            "typical_force",
            "N",
            1e-6,
            1e9,
            None,
            "of the drive while it moves; sets how strong an effect may be",
        ),
        Setting("typical_speed", "m/s", 1e-6, 1e3, None, "of its motions"),
        Setting("stroke", "m", 1e-6, 1e3, None, "length of its way"),
        Setting("middle", "m", -1e3, 1e3, 0.0, "middle of its way"),
        Setting("pitch", "m", 1e-6, 10.0, 0.005, "way per turn of the motor"),
    ),
    links=(
        (
            Link(
                "force",
                "carriage",
                "drive_force_n",
                "N",
                "motion to the force that the drive must give",
            ),
            "force",
        ),
    ),
    parameters=(*_OWN, *(p for law in LAWS for p in law.parameters)),
    effects=(*(law.effect for law in LAWS), *_EFFECTS),
    prepare=prepare,
    residual=residual,
    features=features,
    settled=5.0,
    undetermined=undetermined,
    turning=turning,
    effort="force",
    needs={"force": ("position",)},
    flat=True,
    output_is_foreseen=True,
    at_load=at_load,
    equations=EQUATIONS,
)
