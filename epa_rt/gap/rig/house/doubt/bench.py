"""What a set of parameters makes of a recording where one quantity of the chain is off by an error
(N,) that no law makes.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.prepared import Prepared
from epa_rt.gap.rig.house.residuals import LOAD_HZ, NEEDED, RESIDUALS

MOTION = ("angle", "place")
LENGTH = (*MOTION, "travel", "stretch")
PRESSURE = (
    *LENGTH,
    "gauge0",
    "gauge1",
    "volume",
    "swell",
)  # errors of the gas itself are added to what it gives


def feels_force(params: np.ndarray) -> bool:
    """Whether forces have a part in pressures: a strap that gives, a gauge that feels the pull."""
    return bool(
        np.any(params["muscle"]["strap_compliance_m_n"] != 0.0)
        or params["sensors"]["gauge_crosstalk_pa_n"][0] != 0.0
    )


class Doubted(Bench):
    """As a Bench with these ``errors``: name of what is off to its error (N,), in that quantity's
    own unit.

    ``angle`` (rad) and ``place`` (rad or m), ``gauge0``, ``gauge1`` (Pa), ``force`` (N),
    ``current`` (A): of readings. ``travel`` (m): of the strap's way for one of the spool;
    ``stretch`` (m): of both lines' lengths; (2, N) ``volume``, ``swell`` (m^3), ``pull`` (N): of
    each muscle's; ``gas0``, ``gas1`` (Pa): of its gas. ``torque``, ``radius``, ``loop`` (A): of the
    current that the motion, the commands take. ``load`` (rad/s^2 or m/s^2): of its acceleration.
    """

    def __init__(
        self, prepared: Prepared, params: np.ndarray, errors: Mapping[str, np.ndarray]
    ) -> None:
        super().__init__(prepared, params)
        self.errors = errors
        if "command" in errors:
            self.prepared = replace(prepared, commands=self._late(prepared.commands), cache={})

    def _late(self, commands: np.ndarray) -> np.ndarray:
        error, made = self.errors["command"], commands.copy()
        made["target_angle_rad"] += error
        made["target_speed_rad_s"] += smooth.slope(error, self.prepared.period_s)
        return made

    def _off(self, *names: str) -> bool:
        return not self.errors.keys().isdisjoint(names)

    def kept(self, name: str, blocks: tuple[np.ndarray, ...], make: Callable[[], object]) -> object:
        """Made anew where an error has a part in it."""
        pressure = (*PRESSURE, "pull", "force") if feels_force(self.params) else PRESSURE
        part = {
            "motor": MOTION[:1],
            "line": LENGTH,
            "pressure": pressure,
            "force": (*pressure, "gas0", "gas1", "pull"),
            "spool": tuple(self.errors),
            "torque": tuple(self.errors),
            "current": tuple(self.errors),
            "late part": tuple(self.errors),
        }.get(name.rstrip("01"), ())
        return make() if self._off(*part) else super().kept(name, blocks, make)

    def true(self, port: str) -> np.ndarray:
        name = {
            "motor_current_a": "current",
            "force_n": "force",
            "muscle0_gauge_pa": "gauge0",
            "muscle1_gauge_pa": "gauge1",
        }.get(port)
        value = super().true(port)
        return value - self.errors[name] if name in self.errors else value

    def _motor(self):
        angle, speed, acceleration = super()._motor()
        if "angle" not in self.errors:
            return angle, speed, acceleration
        error = self.errors["angle"]
        rate = smooth.slope(
            smooth.smoothed(error, smooth.gaussian_taps(smooth.FUSE_CYCLES)), self.prepared.period_s
        )  # above it the speed reading is believed
        return (
            angle - error,
            speed - rate,
            acceleration - smooth.slope(rate, self.prepared.period_s),
        )

    def place(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        place, speed, acceleration = super().place()
        if "place" not in self.errors:
            return place, speed, acceleration
        error = self.errors["place"]
        rate = smooth.slope(error, self.prepared.period_s)
        return (
            place - error,
            speed - rate,
            acceleration - smooth.slope(rate, self.prepared.period_s),
        )

    def _line(self, i: int) -> np.ndarray:
        line, error = super()._line(i), 0.0
        if "travel" in self.errors:
            error = (
                error + float(self.params["load"][f"travel{i}_ratio"][0]) * self.errors["travel"]
            )
        if "stretch" in self.errors:
            error = error - self.errors["stretch"][i]
        return (
            line
            if np.isscalar(error)
            else line + np.stack([error, smooth.slope(error, self.prepared.period_s)])
        )

    def _pull(self, i: int, gauge: np.ndarray) -> np.ndarray:
        pull = super()._pull(i, gauge)
        return (
            pull + np.where(pull > 0.0, self.errors["pull"][i], 0.0)
            if "pull" in self.errors
            else pull
        )  # a slack line pulls at nothing

    def volume(self, i: int) -> np.ndarray:
        volume = super().volume(i)
        return volume + sum(
            self.errors[name][i] for name in ("volume", "swell") if name in self.errors
        )

    def pressure(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        truth, seen = super().pressure(i)
        if f"gas{i}" not in self.errors:
            return truth, seen
        error = self.errors[f"gas{i}"] - self._level(self.errors[f"gas{i}"], i)
        return truth + error, seen + error

    def _level(self, error: np.ndarray, i: int) -> np.ndarray:
        """(N,) what the levelling of shut spans to their readings takes off an error, carried on
        until the next span.
        """
        level, at, here = np.empty(len(error)), 0, float(error[0])
        for start, stop in self.prepared.shut[i]:
            level[at:start] = here
            here = float(np.mean(error[start:stop]))
            level[start:stop], at = here, stop
        level[at:] = here
        return level


def doubted_residual(bench: Doubted, link: str) -> np.ndarray:
    """(N,) a link's residual, before its low-pass, as the errors leave it."""
    found = RESIDUALS[link](bench)
    for name, shown in _SHOWN.get(link, {}).items():
        if name in bench.errors:
            found = found - shown(bench, bench.errors[name])
    return found


def _whole(_: Bench, error: np.ndarray) -> np.ndarray:
    return error


def _torque(bench: Bench, error: np.ndarray) -> np.ndarray:
    return float(bench.params["drive"]["torque_constant_nm_a"][0]) * error


def _needed(bench: Bench, error: np.ndarray) -> np.ndarray:
    return NEEDED * _torque(bench, error)


def _acceleration(bench: Bench, error: np.ndarray) -> np.ndarray:
    return smooth.two_poles(error, LOAD_HZ, bench.prepared.period_s)


def _of_place(bench: Bench, error: np.ndarray) -> np.ndarray:
    period_s = bench.prepared.period_s
    return _acceleration(bench, smooth.slope(smooth.slope(error, period_s), period_s))


def _slope(bench: Bench, error: np.ndarray) -> np.ndarray:
    return -smooth.slope(error, bench.prepared.period_s)


# What a link's own reading shows of an error; all else has gone in with the link's inputs.
_SHOWN: dict[str, dict[str, Callable[[Bench, np.ndarray], np.ndarray]]] = {
    "drive": {"current": _whole, "loop": _whole},
    "motor": {"current": _whole, "torque": _whole, "radius": _whole},
    "torque": {"current": _torque, "torque": _needed, "radius": _needed},
    "gas0": {"gauge0": _whole},
    "gas1": {"gauge1": _whole},
    "muscle0": {"force": _whole},
    "load": {"load": _acceleration, "place": _of_place},
    "encoder": {"angle": _slope},
}
