"""What a plant does in a recording, kept for its runs with other instruments: nothing that these do
acts on the plant.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable

import numpy as np

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks import drive, sensors
from epa_rt.models.parameters import PARAMS, copied

MOST_KEPT = 4  # motions of a recording, some two megabytes each
MOST_SEEN = 64  # plants of which is known that they have run once

_FIRST = PARAMS.fields["sensors"][1] // 8  # of the sensors' numbers, among all
_IDEAL = np.array([float(name.endswith("_gain_ratio")) for name in PARAMS["sensors"].names])


def with_ideal_instruments(params: np.ndarray) -> np.ndarray:
    """The same plant, shown as it is."""
    found = copied(params)
    found.view("f8")[_FIRST : _FIRST + len(_IDEAL)] = _IDEAL
    return found


class Motions:
    """Of one recording: readings of ideal instruments, by the plant that they show. Several threads
    ask.
    """

    def __init__(self) -> None:
        self._seen: OrderedDict[bytes, None] = OrderedDict()
        self._kept: OrderedDict[bytes, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def of(self, params: np.ndarray, make: Callable[[np.ndarray], np.ndarray]) -> np.ndarray | None:
        """(N,) SENSORS, to be read only; None of a plant that is asked for the first time: most are
        not asked for again. ``make``: the run of a plant.
        """
        plain = with_ideal_instruments(params)
        key = plain.tobytes()
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
            if key not in self._seen:
                _last(self._seen, key, None, MOST_SEEN)
                return None
            self._seen.move_to_end(key)
        made = make(plain)
        with self._lock:
            _last(self._kept, key, made, MOST_KEPT)
        return made


def _last(kept: OrderedDict, key: bytes, value: object, most: int) -> None:
    """Keeps a value as the last one asked for, and of all no more than ``most``."""
    kept[key] = value
    while len(kept) > most:
        kept.popitem(last=False)


@compiled
def shown(params, state, motion, period_s, readings):
    """What instruments show (N,) of a motion as ideal ones show it; ``state``: STATE (1,) at its
    start.
    """
    p, s = params[0], state[0]
    truth = s.truth
    for k in range(len(motion)):
        ideal = motion[k]
        truth.motor_angle_rad = ideal.motor_angle_rad
        truth.motor_speed_rad_s = ideal.motor_speed_rad_s
        truth.motor_current_a = ideal.motor_current_a
        truth.motor_torque_nm = drive.reported_torque(
            p.drive,
            p.sensors.motor_current_gain_ratio * ideal.motor_current_a
            + p.sensors.motor_current_offset_a,
        )
        truth.pressure_pa[0] = ideal.muscle0_gauge_pa
        truth.pressure_pa[1] = ideal.muscle1_gauge_pa
        truth.supply_pa = ideal.supply_gauge_pa
        truth.muscle_force_n[0] = ideal.force_n
        truth.joint_angle_rad = ideal.joint_angle_rad
        truth.joint_speed_rad_s = ideal.joint_speed_rad_s
        truth.load_position_m = ideal.load_position_m
        sensors.read(p.sensors, s, truth, 0.0, readings[k], period_s)
        s.cycle += 1
