"""What ends the motor's travel: a slack strap, end stops, a spool that winds the strap the other
way.
"""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plant_scenarios import log_commands, silent, simulate

from epa_rt.models import plant
from epa_rt.models.blocks import transmission
from epa_rt.models.plant_file import PlantFile, load_plant
from epa_rt.models.ports import COMMAND, SENSORS, TRUTH

PLANTS = Path(__file__).parents[2] / "config" / "plants"
PERIOD_S = 1e-3
RADIUS_M = 0.010
NO_STOPS = {"travel_stop_stiffness_n_m": 0.0}


def bench(**transmission_values: float) -> PlantFile:
    file = load_plant(PLANTS / "bench.yaml")
    file.params[:] = silent(file.params)
    for name, value in transmission_values.items():
        file.params["transmission"][name] = value
    return file


def thrown(file: PlantFile, cycles: int = 1500) -> np.ndarray:
    """Truths, (N,) TRUTH, after the power goes with the muscle 20 mm stretched and filled."""
    commands = np.zeros(3500 + cycles, COMMAND)
    commands["enabled"][:3500], commands["mode"] = 1.0, 8.0
    per_m = file.params["transmission"]["gear_ratio"][0] / RADIUS_M
    commands["target_angle_rad"] = 0.020 * per_m * np.clip(np.arange(len(commands)) / 1000, 0, 1)
    commands["inlet"][1000:3400, 0] = 1.0
    state, reading = plant.new_state(file.params), np.zeros(1, SENSORS)
    truth = np.zeros(len(commands), TRUTH)
    for k in range(len(commands)):
        plant.advance(file.params, state, commands[k : k + 1], reading, PERIOD_S, file.substeps)
        truth[k] = state["truth"][0]
    assert truth["muscle_force_n"][3499, 0] > 110.0
    return truth[3500:]


def test_a_slack_strap_does_not_pull_whatever_the_pressure():
    truth = thrown(bench(strap_on_spool_m=0.0, **NO_STOPS))
    slack = truth["muscle_length_m"][:, 0] < 0.1199
    assert slack[-1] and truth["pressure_pa"][-1, 0] > 300e3
    assert np.all(truth["muscle_force_n"][slack, 0] == 0.0)
    assert truth["travel_m"][-1] < -0.05  # nothing stops it but friction


def test_end_stops_hold_a_thrown_motor():
    truth = thrown(bench())
    assert -0.030 < truth["travel_m"].min() < -0.025
    assert -0.0255 < truth["travel_m"][-1] < 0.0
    assert abs(truth["motor_speed_rad_s"][-1]) < 5.0


def test_a_spool_past_the_end_of_its_strap_winds_it_up_the_other_way():
    truth = thrown(bench(strap_on_spool_m=0.010, **NO_STOPS))
    spool, length = truth["travel_m"], truth["muscle_length_m"][:, 0]
    turned = spool < -0.010 - math.pi * RADIUS_M
    assert turned.any()
    assert length[turned] == pytest.approx(
        0.12 - 0.010 - (spool[turned] + 0.010 + math.pi * RADIUS_M), abs=1e-12
    )
    # the muscle pulls again, and that slows the motor down
    free = thrown(bench(strap_on_spool_m=0.0, **NO_STOPS))
    assert truth["muscle_force_n"][turned, 0].max() > 20.0
    assert spool.min() > free["travel_m"].min() + 0.010


@given(travel=st.floats(-0.2, 0.1), strap=st.floats(1e-3, 0.1))
def test_the_strap_moves_on_smoothly_with_the_slope_that_is_said(travel, strap):
    p = bench(strap_on_spool_m=strap).params[0]["transmission"]
    step = 1e-7
    before, slope = transmission.strap_travel(p, travel)
    after, _ = transmission.strap_travel(p, travel + step)
    assert after - before == pytest.approx(slope * step, abs=1e-11)
    assert abs(slope) <= 1.0 and before >= -strap - RADIUS_M
    if travel >= -strap:
        assert (before, slope) == (travel, 1.0)


@given(
    depth=st.floats(-0.02, 0.02), speed=st.floats(-1.0, 1.0), side=st.sampled_from([-0.025, 0.045])
)
def test_an_end_stop_only_pushes_back(depth, speed, side):
    p = bench().params[0]["transmission"]
    away = -1.0 if side > 0.0 else 1.0
    force = transmission.stop_force(p, side - away * depth, speed)
    assert force * away >= 0.0 and (depth > 0.0 or force == 0.0)


@pytest.mark.parametrize("name", ["bench", "knee", "mass"])
def test_what_lies_beyond_the_run_changes_no_bit_of_it(name):
    file = load_plant(PLANTS / f"{name}.yaml")
    commands = log_commands(file, 6.0)
    with_ends = simulate(file.params, commands, file.substeps)
    file.params["transmission"]["travel_stop_stiffness_n_m"] = 0.0
    file.params["transmission"]["strap_on_spool_m"] = 0.0
    assert simulate(file.params, commands, file.substeps).tobytes() == with_ends.tobytes()
