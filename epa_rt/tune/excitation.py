"""A short experiment that excites one loop within the rig's limits: multisines on its reference.

The reference is where it enters, so that the usual run does all the rest: the profile is checked
before anything moves, the gate and every trip watch it, a stop brakes it, and the log replays. It
reaches the command through the controller and its feedforward. Two draws of phases in each band,
the second at half the height: what a plant does that is not linear differs between them and shows
as uncertainty. A joint then follows the trial of the experiment itself once: at that size the
feedforward is found.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.experiments.coordinate import coordinate_of
from epa_rt.experiments.oscillations import Multisine
from epa_rt.tune.controller import JOINT, MOTOR, Loop, TuneError

LINES = 14
# from Hz, to Hz, period s, duration s; a band spans less than a decade, so that its slow lines are
# not lost beside its fast ones. The joint is held by muscles, the motor by its drive.
BANDS = {
    JOINT: ((0.125, 1.0, 16.0, 36.0), (1.0, 5.0, 8.0, 28.0), (4.0, 14.0, 2.0, 16.0)),
    MOTOR: ((0.25, 2.0, 8.0, 20.0), (2.0, 12.0, 2.0, 10.0), (12.0, 50.0, 1.0, 6.0)),
}
OF_SAMPLING = 0.05  # of the sampling rate: what an experiment may ask for at most
DRAWS = 2
OF_DRAW = (1.0, 0.5)  # of the height: a plant that rubs or plays answers another size otherwise
FADE_S = 0.5
SHARE = 0.5  # of each limit of motion that the excitation takes at most
OF_FOLLOWING = 0.4  # of the error that trips: the loop may answer with up to twice the reference
OF_RANGE = 0.1  # of the way to the nearest limit of position, where nothing narrower is said
LAG_S = 0.02  # a drive that lags by this behind its target must not trip by its following error
OF_FIRST_WAY = 0.6  # of the way after which the rig's watch asks which way the joint answered
SWIFT_HZ = 1.0  # from here on a joint may lie beyond its resonance and answer the other way


@dataclass(frozen=True)
class Asked:
    """What an operator may say: the mean (a place or a position with its unit), the height from
    lowest to highest point (SI, None: as the limits allow), pressures by muscle, where no
    experiment says them.
    """

    at: str | None = None
    peak_to_peak: float | None = None
    fill: Mapping[str, str] | None = None


def excitation_text(rig: Rig, loop: Loop, base: Mapping[str, Any] | None, asked: Asked) -> str:
    """An experiment file that excites the loop: the phases of ``base`` (an experiment file as
    data) with its trials replaced, or a filling of the muscles as asked. Raises TuneError.
    """
    import yaml

    data = (
        _of_experiment(loop, base, asked)
        if base is not None
        else (*_of_filling(rig, loop, asked), None)
    )
    before, mean, after, motion = data
    coordinate = coordinate_of(rig, loop.name)
    middle = _position(mean, coordinate.places, coordinate.si_unit)
    unit = _UNITS[coordinate.si_unit]
    speed = _shown(0.1 * coordinate.speed_max, coordinate.si_unit) + "/s"
    phases = [
        *before,
        {"name": "tune_go", "loop": loop.name, "move": {"to": mean, "speed": speed}},
        {"name": "tune_rest", "loop": loop.name, "for": "1 s"},
    ]
    top_hz = OF_SAMPLING / rig.period_s
    for i, (low, end, period_s, duration_s) in enumerate(BANDS[loop.kind]):
        high = min(end, top_hz)
        if high < 2.0 * low:
            continue
        height = _height(rig, loop, (low, high, period_s), middle, asked.peak_to_peak)
        for draw in range(DRAWS):
            phases.append(
                {
                    "name": f"tune_{'abc'[i]}{draw + 1}",
                    "loop": loop.name,
                    "trial": True,
                    "seed": 1 + draw + DRAWS * i,
                    "multisine": {
                        "mean": mean,
                        "peak_to_peak": f"{height * OF_DRAW[draw] * unit[0]:.4g} {unit[1]}",
                        "from": f"{low:g} Hz",
                        "to": f"{high:g} Hz",
                        "lines": _lines(low, high, period_s),
                        "period": f"{period_s:g} s",
                        "fade": f"{FADE_S:g} s",
                    },
                    "for": f"{duration_s:g} s",
                }
            )
    if motion is not None and loop.kind == JOINT:
        phases += [
            {"name": "tune_back", "loop": loop.name, "move": {"to": mean, "speed": speed}},
            {"name": "tune_rest_again", "loop": loop.name, "for": "1 s"},
            {**motion, "name": "tune_motion", "loop": loop.name},
        ]
    name = base["experiment"] if base is not None else "filling"
    file = {
        "experiment": f"tune_{loop.kind}",
        "description": f"Multisines that excite the loop {loop.name}; set up as in {name}",
        "loop": loop.name,
        "phases": [*phases, *after],
    }
    text: str = yaml.safe_dump(file, sort_keys=False, allow_unicode=True, width=100)
    return text


def _of_experiment(
    loop: Loop, base: Mapping[str, Any], asked: Asked
) -> tuple[list[dict[str, Any]], str, list[dict[str, Any]], dict[str, Any]]:
    """Phases before the first trial, the mean of that trial, phases after the last one, and that
    trial.
    """
    values = {name: many[len(many) // 2] for name, many in (base.get("repeat") or {}).items()}
    inner = [_filled_in(phase, values) for phase in base["phases"]]
    trials = [i for i, phase in enumerate(inner) if phase.get("trial")]
    if not trials:
        raise TuneError(
            f"found the experiment '{base['experiment']}' without a trial, expected one to put the"
            " excitation in the place of"
        )
    first, last = inner[trials[0]], trials[-1]
    runs_in = first.get("loop") or base["loop"]
    if runs_in != loop.name:
        raise TuneError(
            f"found the experiment '{base['experiment']}' whose trial runs in the loop {runs_in},"
            f" expected {loop.name}, which is to be tuned"
        )
    general = base["loop"]
    before = [*(base.get("before") or []), *inner[: trials[0]]]
    after = [*inner[last + 1 :], *(base.get("after") or [])]
    named = [[{"loop": general, **phase} for phase in part] for part in (before, after)]
    for phase in named[0] + named[1]:
        phase.pop("trial", None)
    return named[0], asked.at or _mean_of(first, base["experiment"]), named[1], first


def _filled_in(phase: Any, values: Mapping[str, Any]) -> Any:
    """A phase with its $names replaced."""
    if isinstance(phase, dict):
        return {key: _filled_in(value, values) for key, value in phase.items()}
    if isinstance(phase, list):
        return [_filled_in(value, values) for value in phase]
    if isinstance(phase, str) and phase.startswith("$"):
        return values.get(phase[1:], phase)
    return phase


def _mean_of(trial: Mapping[str, Any], name: str) -> str:
    from epa_rt.config.units import UnitError, parse_quantity

    for key in ("chirp", "sine", "multisine"):
        if key in trial:
            return str(trial[key]["mean"])
    if "random_speed" in trial:
        try:
            low, high = (parse_quantity(end, "m") for end in trial["random_speed"]["between"])
            return f"{500.0 * (low + high):.6g} mm"
        except UnitError:
            pass
    raise TuneError(f"found no mean in the trial of '{name}', expected --at")


def _of_filling(
    rig: Rig, loop: Loop, asked: Asked
) -> tuple[list[dict[str, Any]], str, list[dict[str, Any]]]:
    """Fill at the rest place, and back to it before venting."""
    for name, text in (asked.fill or {}).items():
        _check_pressure(rig, name, text)
    missing = [m.name for m in rig.muscles if m.name not in (asked.fill or {})]
    if missing:
        raise TuneError(
            f"found no pressure for {', '.join(missing)}, expected --experiment, or --fill for"
            " every muscle"
        )
    joint_mean = "mean" if rig.joint is not None and "mean" in rig.joint.places else None
    mean = asked.at or (joint_mean if loop.kind == JOINT else None)
    if mean is None:
        raise TuneError("found no mean of the excitation, expected --experiment or --at")
    place = "no_load" if "no_load" in rig.motor.places else "0 mm"
    at_motor = "motor_position" if loop.kind == JOINT else loop.name
    speed = _shown(rig.motor.jog_speed_si, si_unit_of(rig.motor.position)) + "/s"
    go = {"loop": at_motor, "move": {"to": place, "speed": speed}}
    wait = {"loop": at_motor, "until": "valves_settled", "timeout": "60 s"}
    orders = {name: {"set": pressure} for name, pressure in (asked.fill or {}).items()}
    before = [{"name": "tune_start", **go}]
    if orders:
        before += [
            {"name": "tune_fill", "valves": orders, **wait},
            # filling warms the gas: let it cool and set the pressures again
            {
                "name": "tune_settle",
                "loop": at_motor,
                "for": "3 s",
                "valves": {"all": "hold_and_trim"},
            },
            {"name": "tune_trim", "valves": orders, **wait},
        ]
    after: list[dict[str, Any]] = [{"name": "tune_return", **go}]
    if orders:
        after.append({"name": "tune_vent", "valves": {"all": "vent"}, **wait})
    return before, mean, after


def _check_pressure(rig: Rig, name: str, text: str) -> None:
    from epa_rt.config.units import UnitError, parse_pressure

    if name not in {muscle.name for muscle in rig.muscles}:
        raise TuneError(f"--fill: found the muscle '{name}', which the rig '{rig.name}' has not")
    try:
        parse_pressure(text, rig.atmosphere_pa)
    except UnitError as error:
        raise TuneError(f"--fill {name}: {error}") from None


def _lines(low_hz: float, high_hz: float, period_s: float) -> int:
    """As many lines as differ, LINES at most."""
    for lines in range(LINES, 2, -1):
        ratio = (high_hz / low_hz) ** (1.0 / (lines - 1))
        if len({round(low_hz * ratio**i * period_s) for i in range(lines)} - {0}) == lines:
            return lines
    return 2


def _height(
    rig: Rig,
    loop: Loop,
    band: tuple[float, float, float],
    middle: float,
    peak_to_peak: float | None,
) -> float:
    """Height from lowest to highest point (SI) that keeps to SHARE of every limit it meets."""
    low_hz, high_hz, period_s = band
    lines = _lines(low_hz, high_hz, period_s)
    ratio = (high_hz / low_hz) ** (1.0 / (lines - 1))
    harmonics = tuple(sorted({round(low_hz * ratio**i * period_s) for i in range(lines)}))
    coordinate = coordinate_of(rig, loop.name)
    axis = rig.joint if loop.kind == JOINT else rig.motor
    assert axis is not None
    room = min(coordinate.limits[1] - middle, middle - coordinate.limits[0])
    bounds = [SHARE * room, OF_RANGE * (coordinate.limits[1] - coordinate.limits[0])]
    if axis.following_error is not None:
        bounds.append(OF_FOLLOWING * axis.following_error)
    if peak_to_peak is not None:
        bounds.append(0.5 * peak_to_peak)
    for draw in range(DRAWS):  # of any draw of phases: these stand for all
        wave = Multisine(0.0, 1.0, harmonics, period_s, 4.0 * period_s, FADE_S, draw)
        peaks = wave.peaks
        bounds += [
            SHARE * coordinate.speed_max / peaks.speed,
            SHARE * coordinate.acceleration_max / peaks.acceleration,
        ]
        bounds += _command_bounds(rig, loop, wave, period_s, low_hz)
    amplitude = min(bounds)
    if amplitude <= 0.0:
        raise TuneError("found a mean outside of the limits of position, expected one inside them")
    return 2.0 * amplitude


def _command_bounds(
    rig: Rig, loop: Loop, wave: Multisine, period_s: float, low_hz: float
) -> list[float]:
    """Amplitudes at which the feedforward of a unit wave meets SHARE of the command's limits."""
    row, motor, gains = rig.row(loop.command), rig.motor, loop.gains
    t_s = np.arange(0.0, period_s, loop.period_s) + FADE_S
    position, speed = wave.sample(t_s)
    if loop.kind == JOINT:
        acceleration = np.gradient(speed, loop.period_s)
        command = loop.command_of * (
            (gains.feedforward + gains.kp) * position
            + gains.feedforward_speed_s * speed
            + gains.feedforward_acceleration_s2 * acceleration
        )
        # the output's two poles as one of the same lag at low frequency
        command = _smoothed(command, gains.output_cutoff_hz / 1.5, loop.period_s)
        following = motor.following_error or float("inf")
        rate = min(row.slew or float("inf"), motor.speed_max, SHARE * following / LAG_S)
        way = _half(row.limits)
        if low_hz >= SWIFT_HZ:
            way = min(way, OF_FIRST_WAY / SHARE * rig.safety.sensors.joint_follows)
        highest = [(command, way), (np.gradient(command, loop.period_s), rate)]
    else:
        command = speed + gains.kp * position
        rate = min(row.slew or float("inf"), motor.acceleration_max)
        highest = [
            (command, min(_half(row.limits), motor.speed_max)),
            (np.gradient(command, loop.period_s), rate),
        ]
    return [SHARE * limit / float(np.max(np.abs(values))) for values, limit in highest]


def _smoothed(values: np.ndarray, cutoff_hz: float, dt_s: float) -> np.ndarray:
    """A first-order low pass over a whole period of a periodic signal."""
    if not np.isfinite(cutoff_hz):
        return values
    hertz = np.fft.rfftfreq(len(values), dt_s)
    smoothed: np.ndarray = np.fft.irfft(
        np.fft.rfft(values) / (1.0 + 1j * hertz / cutoff_hz), len(values)
    )
    return smoothed


def _half(limits: tuple[float, float] | None) -> float:
    return float("inf") if limits is None else 0.5 * (limits[1] - limits[0])


_UNITS = {"m": (1e3, "mm"), "rad": (180.0 / np.pi, "deg")}


def _shown(value: float, si_unit: str) -> str:
    factor, unit = _UNITS[si_unit]
    return f"{value * factor:.4g} {unit}"


def _position(text: str, places: Mapping[str, float], si_unit: str) -> float:
    from epa_rt.config.units import UnitError, parse_quantity

    if text in places:
        return places[text]
    try:
        return parse_quantity(text, si_unit)
    except UnitError as error:
        raise TuneError(f"mean of the excitation: {error}") from None
