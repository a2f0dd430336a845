"""Where a muscle's pressure begins to contradict its valves, to the bound and to the word."""

import pytest

from epa_rt.config.rig import Rig
from epa_rt.safety.gas_watch import GasWatch
from tests.safety.safety_bench import edited, rig

STEP_S, HELD_PA = 0.008, 6e5
INLET, EXHAUST = "cmd_muscle_inlet_open", "cmd_muscle_exhaust_open"
SHUT = {INLET: 0.0, EXHAUST: 0.0}


def without_law() -> Rig:
    return edited("bench", ("    law: {", "    # law: {"))


def shut_in(on: Rig, share: float) -> bool:
    """Whether a loss of this share within 60 ms is refused, of gas that was held for long."""
    watch, pressure_pa = GasWatch(on.muscles[0], on, STEP_S), HELD_PA
    row = {"motor_travel_m": -0.005}
    for _ in range(100):
        assert watch.step(row | {"muscle_pressure_pa": HELD_PA}, SHUT) is None
    while pressure_pa > (1.0 - share) * HELD_PA:
        pressure_pa = max(pressure_pa - 24e3, (1.0 - share) * HELD_PA)
        if watch.step(row | {"muscle_pressure_pa": pressure_pa}, SHUT) is not None:
            return True
    return False


@pytest.mark.parametrize(
    ("share", "with_law", "without"),
    [(0.12, False, False), (0.19, True, False), (0.28, True, True)],
)
def test_without_its_law_the_gas_of_a_muscle_may_be_half_as_far_off_again(share, with_law, without):
    assert shut_in(rig("bench"), share) is with_law
    assert shut_in(without_law(), share) is without
