"""Faults of the bus at the moment at which they do most harm: at full stretch, in lock step."""

import pytest

from tests.bus.faults.traced import TWO_OF_THREE
from tests.faults.on_bus import run_on_bus
from tests.faults.trial import Fault

pytestmark = [pytest.mark.network, pytest.mark.timeout(900)]
HELD_M = 0.5e-3  # a drive that holds lets the motor go no further
AT = "at full stretch"


def test_a_stretched_muscle_is_held_by_a_drive_that_has_lost_its_bus():
    figures = run_on_bus("bench", Fault("cable_pulled"), AT)
    assert figures.injected and figures.power_off_s is None and figures.code == 74
    assert figures.highest_m - figures.lowest_m < HELD_M
    assert figures.rest_s is not None and figures.vented_s is not None


def test_two_of_three_frames_lost_for_good_take_the_power_within_the_reaction_time():
    figures = run_on_bus("bench", Fault(TWO_OF_THREE), AT)
    assert figures.injected and figures.power_off_s <= 0.020
    assert figures.category.startswith("stop category 0: power off, air out: the working counter")
    assert "stored then: motor travel 27.0 mm" in figures.category
