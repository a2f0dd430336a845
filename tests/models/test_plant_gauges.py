"""Pressure readings through a slow tube or filter: its own time constant, behind the sensor's, of
the muscles alone.
"""

from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import log_commands, silent

from epa_rt.models import plant
from epa_rt.models.blocks.sensors import sensors_over_log
from epa_rt.models.parameters import neutral_params
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import SENSORS, TRUTH

PLANTS = Path(__file__).parents[2] / "config" / "plants"
PERIOD_S = 1e-3
STEP_PA, AT = 2e5, 50


def stepped(**numbers: float) -> np.ndarray:
    """Readings (400,) of all pressures stepping up in cycle AT."""
    params, truth = neutral_params(), np.zeros(400, TRUTH)
    for name, value in ({"pressure_lag_s": 0.0} | numbers).items():
        params["sensors"][name] = value
    atmosphere = params["gas"]["atmosphere_pa"][0, 0]
    truth["pressure_pa"] = truth["supply_pa"][:, None] = atmosphere
    truth["pressure_pa"][AT:] += STEP_PA
    truth["supply_pa"][AT:] += STEP_PA
    return sensors_over_log(params, truth, PERIOD_S)


@pytest.mark.parametrize("lag_s", [0.004, 0.03, 0.2])
@pytest.mark.parametrize("port", ["muscle0_gauge_pa", "muscle1_gauge_pa"])
def test_a_step_fades_with_the_time_constant(lag_s, port):
    reading = stepped(gauge_lag_s=lag_s)[port]
    left = 1.0 - reading / STEP_PA
    assert np.all(reading[:AT] == 0.0) and left[AT - 1] == 1.0
    assert np.allclose(
        left[AT + 1 : AT + 21] / left[AT : AT + 20], np.exp(-PERIOD_S / lag_s), rtol=1e-9
    )
    after = AT + round(lag_s / PERIOD_S)
    assert left[after] == pytest.approx(
        np.exp(-1.0), abs=0.5 * PERIOD_S / lag_s
    )  # the step itself takes a cycle


def test_it_comes_on_top_of_the_sensors_own_lag():
    own, tube = 0.01, 0.04
    reading = stepped(pressure_lag_s=own, gauge_lag_s=tube)["muscle0_gauge_pa"]
    t = (
        np.arange(400) - AT + 0.5
    ) * PERIOD_S  # straight over a cycle: as if it stepped in its middle
    both = np.where(
        t > 0.0, 1.0 - (tube * np.exp(-t / tube) - own * np.exp(-t / own)) / (tube - own), 0.0
    )
    assert np.max(np.abs(reading / STEP_PA - both)) < 2e-3


def test_the_supply_is_read_as_before():
    assert (
        stepped(gauge_lag_s=0.05)["supply_gauge_pa"].tobytes()
        == stepped()["supply_gauge_pa"].tobytes()
    )


@pytest.mark.parametrize("name", ["bench", "knee"])
def test_without_it_the_tube_is_not_there_at_all(name):
    """Whatever its state holds, not a bit of it shows, and it is not moved."""
    file = load_plant(PLANTS / f"{name}.yaml")
    params, commands = silent(file.params), log_commands(file, 4.0)
    assert params["sensors"]["gauge_lag_s"][0] == 0.0
    found = []
    for left_pa in (0.0, 12345.0):
        state, out = plant.new_state(params), np.zeros(len(commands), SENSORS)
        state["tube_reading_pa"] = left_pa
        plant.run(params, state, commands, PERIOD_S, file.substeps, out)
        assert np.all(state["tube_reading_pa"] == left_pa)
        found.append(out.tobytes())
    assert found[0] == found[1]
