"""The controller over frequency is what the loop's own controller does, sample by sample."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.config.rig import load_rig
from epa_rt.loop.assembly import motion_of
from epa_rt.tune.controller import Gains, TuneError, controller_of, loop_of, written_gains

RIGS = "config/rigs"


@given(
    kp=st.floats(0.0, 5.0),
    ki=st.floats(0.0, 20.0),
    kd=st.floats(0.0, 0.3),
    cutoff=st.floats(3.0, 60.0),
    smooth=st.floats(3.0, 60.0),
    hertz=st.sampled_from([0.5, 2.0, 5.0]),
    of_reference=st.booleans(),
)
@settings(max_examples=12, deadline=None)
def test_a_sine_through_the_joint_controller(kp, ki, kd, cutoff, smooth, hertz, of_reference):
    rig = load_rig(f"{RIGS}/knee.yaml")
    loop = loop_of(rig, "joint")
    gains = Gains(kp, ki, kd, cutoff, smooth, 1.3, 0.1, 0.01)
    motion = motion_of(written_gains(rig, loop, gains), "joint_angle", "position")
    motion.reset({loop.output: 0.0, "motor_travel_m": 0.0}, {loop.command: 0.0})
    count, dt_s = 4000, rig.period_s
    omega, size = 2.0 * math.pi * hertz, 1e-4
    sent = np.empty(count)
    for k in range(count):
        wave, rate = size * math.cos(omega * k * dt_s), -size * omega * math.sin(omega * k * dt_s)
        r, v, y = (wave, rate, 0.0) if of_reference else (0.0, 0.0, wave)
        step = motion.step({loop.output: y}, {loop.reference: r, loop.reference_speed: v}, dt_s)
        sent[k] = step[loop.command]
    last = slice(count - 2000, count)
    phase = np.exp(-1j * omega * dt_s * np.arange(count)[last])
    answer = 2.0 * np.mean((sent[last] - np.mean(sent[last])) * phase) / size
    controller = controller_of(loop, gains, np.array([hertz]))
    wanted = controller.forward[0] if of_reference else -controller.feedback[0]
    assert abs(answer - wanted) <= 0.02 * abs(wanted) + 1e-4


def test_the_motor_loop_is_gain_and_feedforward():
    loop = loop_of(load_rig(f"{RIGS}/bench.yaml"), "motor")
    controller = controller_of(loop, Gains(10.0), np.array([1.0]))
    assert controller.feedback[0] == 10.0
    assert controller.forward[0] == pytest.approx(10.0 + 2j * math.pi)


def test_a_rig_without_a_joint_has_no_joint_loop():
    with pytest.raises(TuneError, match="'bench' without a joint"):
        loop_of(load_rig(f"{RIGS}/bench.yaml"), "joint")
