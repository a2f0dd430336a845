"""What the links of this house's rigs need of a recording and no knob changes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from epa_rt.config.ports import VALVE_PORTS
from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.channels import Channel
from epa_rt.gap.rig.house.commands import commands_of, lost_rows, untold
from epa_rt.gap.rig.house.readings import encoder, read
from epa_rt.gap.rig.house.whole import on_grid
from epa_rt.models.blocks.bus import POSITION_MODE
from epa_rt.models.blocks.drive import SPEED_MODE, TORQUE_MODE

SHUT_S = 0.04  # a valve's own lag, after which a shut one passes nothing
SHORTEST_SHUT_S = 0.05
STAND_S, STAND_STEPS = 0.15, 6
KEPT = 24  # results of a recording, some half a megabyte each
# after a longer gap in what a drive is fed with: six times what its integral takes to be led back
# (motor_link.STANDING_S)
LED_S = 0.3
BRIDGED = 3  # cycles that a straight line makes good
TARGETS = {
    POSITION_MODE: "target_angle_rad",
    SPEED_MODE: "target_speed_rad_s",
    TORQUE_MODE: "target_torque_nm",
}  # by the drive's mode (CiA 402)
LEAP, OFTEN = (
    2.1,
    0.02,
    # steps of a target by which it bends in a cycle (a smooth one's rounding: two at most), and
    # share of the cycles
)
START_S = 0.2  # of a recording, not judged: filters and lags settle


@dataclass
class Prepared:
    """All arrays (N,) on the gapless grid of cycles; ``bad`` says where a channel had nothing to
    say.

    ``readings``: port to what the instrument showed, gaps bridged. ``angle``, ``speed``,
    ``acceleration``: (2, N) parts that stem from the motor's angle and from its speed reading,
    which add up. ``shut``: per muscle (spans, 2), first and last + 1 cycle of each span in which
    its valves pass nothing. ``standing``: bool, the motor moves by no more than a few counts: what
    sticks there is known to a count at best. ``led``: bool, there and where the motion or its
    targets are not known, and for LED_S after. ``renewed``: encoder readings without their hold.
    ``residuals``: by link and bytes of parameters, to be read only.
    """

    name: str
    period_s: float
    place: np.ndarray
    commands: np.ndarray
    readings: dict[str, np.ndarray]
    bad: dict[str, np.ndarray]
    hold: int
    phase: int
    renewed: dict[str, np.ndarray]
    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    smooth: dict[str, np.ndarray]
    shut: tuple[np.ndarray, ...]
    standing: np.ndarray
    led: np.ndarray
    judged: dict[str, np.ndarray] = field(default_factory=dict)
    cache: dict = field(default_factory=dict)
    residuals: dict = field(default_factory=dict)

    @property
    def count(self) -> int:
        return len(self.commands)

    def kept(self, key: tuple, make: Callable[[], object]) -> object:
        """What ``make`` gives, made once for a key while that is asked for again: of many the ones
        asked for last stay.
        """
        found = self.cache.pop(key, None)
        if found is None:
            found = make()
            if len(self.cache) > KEPT:
                for old in list(self.cache)[: KEPT // 2]:
                    self.cache.pop(old, None)
        self.cache[key] = found
        return found


def prepare(
    rig: Rig, channels: dict[str, Channel], hold_s: float, recording: Recording
) -> Prepared:
    """A recording bridged, scaled to the plant's ports and smoothed. ``hold_s``: of the encoder's
    readings. Raises KeyError where a column of the rig is missing.
    """
    columns, place = on_grid(recording)
    period, commands = recording.period_s, commands_of(rig, columns)
    readings, bad, hold, phase = read(channels, hold_s, recording)
    angle_raw, speed_raw = encoder(readings, len(commands), period)
    renewed = {
        "motor_angle_rad": smooth.renewed(angle_raw, hold, phase),
        "motor_speed_rad_s": smooth.renewed(speed_raw, hold, phase),
    }
    angle, speed, acceleration = _fused(
        renewed["motor_angle_rad"], renewed["motor_speed_rad_s"], period
    )
    still = standing(angle_raw, channels.get("motor_angle_rad"), period)
    return Prepared(
        recording.name,
        period,
        place,
        commands,
        readings,
        bad,
        hold,
        phase,
        renewed,
        angle,
        speed,
        acceleration,
        _derived(readings, period),
        tuple(shut_spans(commands, i, period) for i in (0, 1)),
        still,
        still | _unknown(commands, lost_rows(rig, columns), bad, period),
    )


def _unknown(
    commands: np.ndarray, lost: np.ndarray, bad: Mapping[str, np.ndarray], period_s: float
) -> np.ndarray:
    """(N,) bool: what the drive is fed with is not known for longer than a straight line bridges,
    and for LED_S after that.
    """
    gone = np.logical_or.reduce(
        [
            lost,
            *(
                bad[port]
                for port in ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a")
                if port in bad
            ),
        ]
    )
    long = smooth.long_runs(gone, BRIDGED)
    return smooth.any_before(long | (lost & unsteady(commands)), round(LED_S / period_s))


def followed(rig: Rig, columns: dict[str, np.ndarray]) -> dict[str, bool]:
    """By name, of what ``untold`` looks at, whether free run can follow: a hole of some cycles is
    made good, in a target but where targets leap, and longer ones are not, after which the motor is
    elsewhere; but before its first value a valve is safe and a drive off.
    """
    found, targets = {}, {row.name for row in rig.outputs if row.port not in VALVE_PORTS}
    for name, rows in untold(rig, columns).items():
        if name in targets:
            found[name] = not rows.any() or not (
                smooth.long_runs(rows, BRIDGED).any() or unsteady(commands_of(rig, columns))
            )
        else:
            found[name] = not smooth.long_runs(
                rows & np.logical_or.accumulate(np.isfinite(columns[name])), BRIDGED
            ).any()
    return found


def unsteady(commands: np.ndarray) -> bool:
    """Whether targets leap from cycle to cycle, as those of a loop do that hears noise: no straight
    line says what a lost one was.
    """
    for mode, name in TARGETS.items():
        values, used = commands[name], (commands["mode"] == mode) & (commands["enabled"] > 0.5)
        bends, steps = (
            np.diff(values, 2)[used[:-2] & used[1:-1] & used[2:]],
            np.abs(np.diff(values)),
        )
        if (
            len(bends)
            and np.mean(np.abs(bends) > LEAP * np.min(steps[steps > 0.0], initial=np.inf)) > OFTEN
        ):
            return True
    return False


def _fused(angle: np.ndarray, speed: np.ndarray, period_s: float):
    """Angle, speed and acceleration as two parts each: slow from the angle, fast from the speed
    reading.
    """
    taps = smooth.gaussian_taps(smooth.FUSE_CYCLES)
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) * period_s
    slow, fast = smooth.smoothed(angle, taps), travelled - smooth.smoothed(travelled, taps)
    slow_speed, fast_speed = smooth.slope(slow, period_s), speed - smooth.smoothed(speed, taps)
    return (
        np.stack([slow, fast]),
        np.stack([slow_speed, fast_speed]),
        np.stack([smooth.slope(slow_speed, period_s), smooth.slope(fast_speed, period_s)]),
    )


def _derived(readings: dict[str, np.ndarray], period_s: float) -> dict[str, np.ndarray]:
    """Slopes of pressures; position, speed and acceleration of the load."""
    found = {}
    for port, values in readings.items():
        if "gauge" in port:
            found[f"{port}_slope"] = smooth.slope(
                smooth.flat_smoothed(values, smooth.gaussian_taps(smooth.SLOPE_CYCLES)), period_s
            )
    taps = smooth.gaussian_taps(smooth.PLACE_CYCLES)
    for port in ("joint_angle_rad", "load_position_m"):
        if port in readings:
            found["place"] = smooth.flat_smoothed(readings[port], taps)
            found["place_speed"] = smooth.slope(found["place"], period_s)
            found["place_acceleration"] = smooth.slope(found["place_speed"], period_s)
    return found


def standing(angle: np.ndarray, channel: Channel | None, period_s: float) -> np.ndarray:
    """(N,) bool: the angle keeps within STAND_STEPS of its counts for STAND_S about this cycle."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    width = 2 * round(0.5 * STAND_S / period_s) + 1
    moved = maximum_filter1d(angle, width) - minimum_filter1d(angle, width)
    return moved <= STAND_STEPS * (channel.step if channel else 0.0) * (1.0 + 1e-9)


def shut_spans(commands: np.ndarray, muscle: int, period_s: float) -> np.ndarray:
    """(spans, 2) of int: where a muscle's valves were both told to be shut, less the time they need
    for it.
    """
    shut = (commands["inlet"][:, muscle] < 0.5) & (commands["exhaust"][:, muscle] < 0.5)
    starts, stops = smooth.runs(shut)
    long = (stops - starts) * period_s > SHORTEST_SHUT_S
    starts = starts + np.where(starts > 0, round(SHUT_S / period_s), 0)
    return np.stack([starts[long], stops[long]], axis=1).astype(np.int64)
