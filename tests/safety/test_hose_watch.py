"""Exchanged hoses: each pressure follows the other muscle's volume; sound ones follow their own."""

import math

import pytest

from epa_rt.safety.gas_watch import CAUSE
from epa_rt.safety.hose_watch import HoseWatch
from epa_rt.safety.in_motion import InMotion
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import edited, rig

STEP_S, HELD_PA = 0.024, 3e5


class Knee:
    """Two muscles that are stretched in turn, their gas shut in; ``exchanged`` swaps the hoses."""

    def __init__(self):
        self.rig = rig("knee")
        self.geometries = tuple(geometry_of(muscle, self.rig) for muscle in self.rig.muscles)
        self.check = HoseWatch(self.rig.muscles, self.geometries, STEP_S)
        self.outputs = {v: 0.0 for m in self.rig.muscles for v in (m.inlet, m.exhaust)}

    def go(self, steps, exchanged=False, moves=1.0, only=None, noise_pa=0.0):
        for k in range(steps):
            angle = moves * 0.10 * math.sin(3.0 * k * STEP_S)
            measured = {
                self.rig.motor.position: 0.010 + 0.200 * angle,  # the SPAM goes the other way
                self.rig.joint.position: angle,
            }
            true = [HELD_PA / g.volume_ratio(g.length(measured)) for g in self.geometries]
            read = true[::-1] if exchanged else true
            if only is not None:
                read[only] = true[only]
            for i, muscle in enumerate(self.rig.muscles):
                measured[muscle.pressure] = read[i] + noise_pa * math.sin(40.0 * k * k)
            refusal = self.check.step(measured, self.outputs)
            if refusal is not None:
                return k, refusal
        return None


def test_exchanged_hoses_are_found_within_seconds_and_named():
    k, (cause, signal, sentence) = Knee().go(400, exchanged=True)
    assert cause == CAUSE and signal == "spam_pressure_pa" and k * STEP_S < 5.0
    assert "check the hoses of spam and ppam (exchanged)" in sentence


@pytest.mark.parametrize(
    "case",
    [
        {},
        {"noise_pa": 3e3},
        {"exchanged": True, "moves": 0.02},
        {"exchanged": True, "only": 0},
        {"exchanged": True, "noise_pa": 5e4},
    ],
)
def test_sound_ones_small_motion_one_muscle_alone_and_noise_are_passed(case):
    assert Knee().go(400, **case) is None


def test_an_open_valve_begins_anew():
    knee = Knee()
    for _ in range(6):
        assert knee.go(35, exchanged=True) is None
        knee.outputs["cmd_ppam_exhaust_open"] = 1.0
        assert knee.go(1, exchanged=True) is None
        knee.outputs["cmd_ppam_exhaust_open"] = 0.0


def test_without_the_law_of_both_muscles_hoses_are_not_asked():
    law = (
        "    law: {braid_length: 207.8 mm, braid_turns: 2.08, rest_length: 134 mm, per_travel: 0,"
        " per_joint: -57 mm/rad}\n"
    )
    names = [
        {law.__self__.__class__.__name__ for laws in InMotion(on)._turns for law in laws}
        for on in (rig("knee"), edited("knee", (law, "")))
    ]
    assert "HoseWatch" in names[0] and names[1] == names[0] - {"HoseWatch"}
