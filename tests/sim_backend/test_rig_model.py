"""The model's own clock, latency and end."""

import numpy as np
import pytest
from sim_rigs import NAMES, ROOT, Driven, rig

from epa_rt.backend import BackendError
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend


def test_a_command_shows_in_the_sensors_one_cycle_later():
    quiet, told = Driven("bench").enable(9), Driven("bench").enable(9)
    first = told.cycle(cmd_motor_speed_m_s=0.08), quiet.cycle()
    assert dict(first[0]) == dict(first[1])
    assert told.cycles(3)["motor_current_a"] > quiet.cycles(3)["motor_current_a"] + 0.5


@pytest.mark.parametrize("name", NAMES)
def test_warming_up_changes_nothing(name):
    warm, cold = Driven(name), Driven(name)
    warm.model.warm_up()
    for _ in range(50):
        assert warm.model.cycle(bytes(warm.encoder.size)) == cold.model.cycle(
            bytes(cold.encoder.size)
        )


def test_another_seed_is_other_noise():
    def images(seed: int) -> list[bytes]:
        driven = Driven("bench", seed)
        return [driven.model.cycle(bytes(driven.encoder.size)) for _ in range(50)]

    assert images(1) == images(1) != images(2)


def test_a_plant_that_runs_away_ends_the_run_with_a_sentence():
    backend = SimBackend(rig("bench"), load_plant(ROOT / "config/plants/bench.yaml"))
    backend.open()
    size = Driven("bench").encoder.size
    backend.exchange(bytes(size))
    backend.model.state["smooth"][:] = np.nan
    with pytest.raises(
        BackendError,
        match=(
            "found sensors of the simulated plant that are no numbers 0.002 s into the run,"
            " expected"
        ),
    ):
        backend.exchange(bytes(size))
    backend.close()
    backend.close()
    with pytest.raises(BackendError, match="a closed backend"):
        backend.exchange(bytes(size))
