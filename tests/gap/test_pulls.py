"""A spool that is not round and a force that is read wrongly are told from a motor that is wrong itself."""

import numpy as np
import pytest

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.pulls import Pulled, pull_first
from tests.gap.toy import White

LINKS = ("torque", "motor")
PER_NM = {"torque": 1.0, "motor": 1.0 / 0.045}       # of a torque: in N*m, and in A
NOISE = {"torque": 2e-4, "motor": 5e-3}
TURNS = 19.0
N = 6000
TIME = np.arange(N) / 100.0
SPEED = 30.0 * np.sin(0.7 * TIME) + 12.0 * np.sin(1.9 * TIME)
ANGLE = 8.0 + np.cumsum(SPEED) / 100.0
SPOOL = ANGLE / TURNS
GAUGE = 3.5e5 + 1.2e5 * np.sign(np.sin(0.09 * TIME)) + 1.1e5 * np.sin(0.23 * TIME + 1.0)
FORCE = 8e-5 * GAUGE * (1.0 + 0.8 * np.tanh(2.0 * (SPOOL - SPOOL.mean()))) + 6.0 * np.sin(2.3 * TIME)
ARM_M = 0.01 / TURNS


class Motor:
    """Two links fed with a motor's motion and the force that pulls at it; ``torque``: what the rig has beside them, (N,)."""

    pulled = Pulled(LINKS, ("muscle0", "gauge_pa"), TURNS)

    def __init__(self, torque):
        taken = np.column_stack([FORCE, np.gradient(SPEED), SPEED, np.tanh(SPEED / 3.0)])  # by nominal parameters, before a place is asked for
        self.torque = torque - taken @ np.linalg.lstsq(taken, torque, rcond=None)[0]

    def residual(self, prepared, values, link):
        return PER_NM[link] * self.torque + NOISE[link] * np.random.default_rng(LINKS.index(link)).standard_normal(N)

    def features(self, prepared, link):
        if link == "muscle0":
            return {"gauge_pa": GAUGE}
        return {"motor_angle_rad": ANGLE, "motor_speed_rad_s": SPEED, "motor_acceleration_rad_s2": np.gradient(SPEED) * 100.0, "time_s": TIME,
                "force_n": FORCE, "current_a": FORCE * ARM_M / 0.045 + 0.05 * np.tanh(SPEED / 2.0), "current_squared_a2": np.full(N, 0.2)}


def places(significance=300.0):
    return tuple(Place(block, link, link, "N", 1.0, 1.0, 0.0, 1.0, z, {}, {}, {})
                 for block, link, z in (("drive", "torque", significance), ("drive", "motor", 0.7 * significance), ("muscle", "muscle0", 4.0)))


def first(torque, **more):
    return pull_first(Motor(torque), {"log": None}, {}, {link: White(link, NOISE[link]) for link in LINKS}, places(**more))[0].block


@pytest.mark.parametrize("phase_rad", (-2.0, 0.3, 1.5))
def test_a_spool_that_is_not_round_is_the_transmissions(phase_rad):
    assert first(FORCE * ARM_M * 0.05 * np.sin(SPOOL + phase_rad)) == "transmission"


def test_a_spool_that_winds_up_is_the_transmissions():
    assert first(FORCE * ARM_M * 0.02 * SPOOL**2) == "transmission"


def test_a_force_that_feels_the_pressure_is_the_sensors():
    assert first(ARM_M * 1e-5 * (GAUGE + 2e-6 * GAUGE**2)) == "sensors"


@pytest.mark.parametrize("torque", (
    2e-3 * np.tanh(SPEED / 3.0) * np.exp(-((SPEED / 20.0) ** 2)), 3e-3 * np.sin(4.0 * ANGLE), 2e-3 * np.tanh(SPEED / 3.0) * np.sin(SPOOL), 3e-6 * SPEED * np.abs(SPEED),
    0.2 * ARM_M * np.tanh(SPEED / 3.0) * FORCE, np.full(N, 1e-3)), ids=("low speed", "cogs", "rub", "windage", "mesh", "current zero"))
def test_what_a_motor_does_itself_stays_its_own(torque):
    assert first(torque) == "drive"


def test_links_that_are_hardly_off_say_nothing():
    assert first(FORCE * ARM_M * 0.05 * np.sin(SPOOL), significance=12.0) == "drive"


def test_rigs_without_a_pulled_motor_are_left_alone():
    assert pull_first(object(), {}, {}, {}, places()) == places()
