"""The sent commands through the plant alone make the log that the simulated rig made."""

import numpy as np
import pytest

from epa_rt.gap.rig.house.noise import noise_of
from epa_rt.models.tables_load import split
from tests.gap.house.runs import recorded, subject


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_without_noise_the_same_plant_makes_the_same_log(rig, tmp_path):
    house, log = subject(rig), recorded(rig, 1)
    made = house.free_run(log, {}, None)
    for port, channel in house.channels.items():
        steps = (
            (log.columns[channel.column] - made.columns[channel.column])
            * channel.scale
            / channel.step
        )
        noise = float(house.plant.params["sensors"]["{}_noise{}".format(*split(port))][0])
        most = 0.501 + 6.0 * noise / channel.step
        assert np.abs(steps).max() <= most, (
            f"{port}: {np.abs(steps).max():.2f} steps, expected at most {most:.2f}"
        )


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_noise_is_found_in_the_recording(rig):
    house, log = subject(rig), recorded(rig, 1)
    made = house.free_run(log, {}, None)
    found = noise_of(house.prepare(log), house.channels, house.prepare(made))
    for port, name in (
        ("muscle0_gauge_pa", "muscle0_gauge_noise_pa"),
        ("force_n", "force_noise_n"),
        ("motor_current_a", "motor_current_noise_a"),
    ):
        true = float(house.plant.params["sensors"][name][0])
        assert found[port] == pytest.approx(true, rel=0.2), port
    assert found["motor_angle_rad"] == 0.0


def test_two_seeds_differ_and_one_seed_does_not():
    house, log = subject("bench"), recorded("bench", 1)
    one, same, other = (
        house.free_run(log, {}, seed).columns["muscle_force_n"] for seed in (1, 1, 2)
    )
    assert np.array_equal(one, same) and not np.array_equal(one, other)
    assert np.std(one - other) == pytest.approx(
        np.sqrt(2) * np.hypot(0.3, 0.2441 / np.sqrt(12)), rel=0.05
    )


def test_rounding_that_no_noise_dithers_is_another_one_in_every_twin():
    house, log = subject("bench"), recorded("bench", 1)
    channel = house.channels["motor_speed_rad_s"]
    clean, step = (
        house.free_run(log, {}, None).columns[channel.column],
        channel.step / abs(channel.scale),
    )
    errors = [house.free_run(log, {}, seed).columns[channel.column] - clean for seed in range(1, 7)]
    assert max(np.abs(error).max() for error in errors) < 0.501 * step
    held = np.abs(np.diff(clean)) < 0.01 * step  # a speed that stands on one count
    assert held.sum() > 1000
    spread = np.std([error[1:][held] for error in errors], axis=0)
    assert (
        np.quantile(spread, 0.1) > 0.1 * step
    )  # at one place of the steps all six would round alike
