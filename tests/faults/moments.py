"""Four moments of a run at which a fault does different harm, told from the plant itself."""

from collections.abc import Callable
from typing import NamedTuple

from epa_rt.config.rig import Rig
from sim_backend.rig_model import RigModel

MOMENTS = ("at rest", "at speed", "at full stretch", "while filling")

_PHASES = """
experiment: faults
loop: {loop}
seed: 1
phases:
  - {{name: go_to_no_load, loop: {back}, move: {{to: no_load, speed: 20 mm/s}}}}
  - {{name: fill, loop: {back}, valves: {{all: {{set: {pressure}}}}}, until: valves_settled, timeout: 30 s}}
  - {{name: hold, loop: {back}, for: 0.6 s, valves: {{all: hold}}}}
  - {{name: out, move: {out}, valves: {{all: hold}}}}
  - {{name: stretched, for: 0.6 s, valves: {{all: hold}}}}
  - {{name: back, loop: {back}, move: {{to: no_load, speed: {speed}}}}}
  - {{name: vent, loop: {back}, valves: {{all: vent}}, until: valves_settled, timeout: 30 s}}
"""  # noqa: E501


class Motion(NamedTuple):
    """The run of one rig: its words for the phases, and motor speeds and travels that tell them."""

    words: dict[str, str]
    fast_m_s: float  # at speed: faster than this
    out_m: float  # at full stretch: this far from where the fill was, or further


_SPEED_LOOP = {
    "loop": "motor_speed",
    "back": "motor_speed",
    "pressure": "460 kPa gauge",
    "out": "{to: 27 mm, speed: 60 mm/s}",
    "speed": "60 mm/s",
}
_JOINT_LOOP = {"loop": "joint_angle", "back": "motor_position"}
MOTIONS = {
    "bench": Motion(_SPEED_LOOP, 0.055, 0.0265),
    "bench_analog": Motion(_SPEED_LOOP, 0.055, 0.0265),
    "knee": Motion(
        {
            **_JOINT_LOOP,
            "pressure": "84 kPa gauge",
            "out": "{to: 10 deg, speed: 60 deg/s}",
            "speed": "80 mm/s",
        },
        0.06,
        0.006,
    ),
    "mass": Motion(
        {
            **_JOINT_LOOP,
            "pressure": "580 kPa gauge",
            "out": "{to: 20 mm, speed: 200 mm/s}",
            "speed": "100 mm/s",
        },
        0.1,
        0.0095,
    ),
}


def experiment_text(rig_name: str) -> str:
    """The experiment file of a rig's run."""
    return _PHASES.format(**MOTIONS[rig_name].words)


class Row(NamedTuple):
    """One plant cycle, from the plant itself, in SI: power, valves, motion, every muscle's air."""

    powered: bool
    inlet_open: tuple[bool, ...]
    exhaust_open: tuple[bool, ...]
    speed_m_s: float
    travel_m: float
    pressure_pa: tuple[float, ...]
    force_n: float


def row_of(model: RigModel, muscles: int) -> Row:
    """What the plant is doing now."""
    command, truth = model.command[0], model.state[0]["truth"]
    gear = model.params["transmission"][0]
    m_per_rad = float(gear["spool_radius_m"] / gear["gear_ratio"])
    return Row(
        bool(command["enabled"] > 0.5),
        tuple(bool(value > 0.5) for value in command["inlet"][:muscles]),
        tuple(bool(value > 0.5) for value in command["exhaust"][:muscles]),
        float(truth["motor_speed_rad_s"]) * m_per_rad,
        float(truth["travel_m"]),
        tuple(float(value) for value in truth["pressure_pa"][:muscles]),
        float(truth["muscle_force_n"][0]),
    )


class MomentWatch:
    """``step`` takes one row and says whether the moment has come, once."""

    def __init__(self, rig: Rig, moment: str):
        motion = MOTIONS[rig.name]
        self._fast_m_s, self._out_m = motion.fast_m_s, motion.out_m
        self._filled_pa = rig.atmosphere_pa + 30e3
        self._slow_m_s = 0.2 * motion.fast_m_s
        self._filled_at_m: float | None = None
        self._holds: Callable[[Row], bool]
        self._holds, self._cycles = {
            "at rest": (self._at_rest, round(0.3 / rig.period_s)),
            "at speed": (self._at_speed, 1),
            "at full stretch": (self._at_full_stretch, round(0.2 / rig.period_s)),
            "while filling": (self._filling, round(0.1 / rig.period_s)),
        }[moment]
        self._lasted, self.come = 0, False

    def step(self, row: Row) -> bool:
        """True in the cycle in which the moment has lasted long enough."""
        if self.come:
            return False
        if row.powered and row.inlet_open[0]:
            self._filled_at_m = row.travel_m
        self._lasted = self._lasted + 1 if row.powered and self._holds(row) else 0
        self.come = self._lasted >= self._cycles
        return self.come

    def _holding(self, row: Row) -> bool:
        shut = not any(row.inlet_open) and not any(row.exhaust_open)
        return shut and min(row.pressure_pa) > self._filled_pa and self._filled_at_m is not None

    def _out(self, row: Row) -> float:
        return abs(row.travel_m - (self._filled_at_m or 0.0))

    def _at_rest(self, row: Row) -> bool:
        still = abs(row.speed_m_s) < self._slow_m_s
        return self._holding(row) and still and self._out(row) < 0.5 * self._out_m

    def _at_speed(self, row: Row) -> bool:
        return self._holding(row) and abs(row.speed_m_s) > self._fast_m_s

    def _at_full_stretch(self, row: Row) -> bool:
        still = abs(row.speed_m_s) < self._slow_m_s
        return self._holding(row) and still and self._out(row) > self._out_m

    def _filling(self, row: Row) -> bool:
        return row.inlet_open[0]
