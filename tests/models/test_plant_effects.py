"""Effects: neutral is exactly absent, and every effect moves something."""

from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import log_commands, silent, simulate

from epa_rt.models.parameters import BLOCKS, TWICE, effects
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import SENSORS

PLANTS = Path(__file__).parents[2] / "config" / "plants"
SECONDS = 5.0
# A value that must show, per switching parameter.
TYPICAL = {
    "command_delay_s": 2.3e-3, "valve_delay_s": 11.4e-3, "stribeck_ratio": 0.1, "cogging_nm": 3e-3,
    "torque_ripple_ratio": 0.03, "bus_sag_ohm": 0.4, "torque_loss_per_k": 2e-3, "gear_efficiency_ratio": 0.75,
    "gear_friction_n": 10.0, "backlash_rad": 8e-3, "eccentricity_ratio": 0.03, "leak_per_s": 5e-4,
    "fill_heating_ratio": 1.3, "heat_exchange_per_s": 0.3, "supply_droop_pa_s_kg": 2e8, "inlet_seat_leak_ratio": 0.01,
    "exhaust_seat_leak_ratio": 0.01, "slip_ratio": 0.09, "dahl_ratio": 0.05, "bladder_stiffness_n_m": 300.0,
    "threshold_pa": 4e4, "end_length_m": 1e-3, "lock_stiffness_n_m": 5e4, "lock_viscous_n_s_m": 50.0,
    "strap_compliance_m_n": 1e-5, "creep_stiffness_n_m": 300.0, "coulomb_n": 3.0, "knee_coulomb_nm": 0.1,
    "payload_kg": 0.1, "misalignment_rad": 0.03, "lever_slope_per_rad": 0.2, "encoder_eccentricity_rad": 1e-3,
}
# What else must hold for a row to show: an isothermal gas has no heat to lose, a lock must be reached, and so on.
NEEDED = {
    "heat_exchange_per_s": [("gas", "polytropic_ratio", 1.3)],
    "lock_stiffness_n_m": [("muscle", "lock_length_m", 0.135)],
    "lock_viscous_n_s_m": [("muscle", "lock_length_m", 0.135)],
    "bus_sag_ohm": [("drive", "supply_v", 6.0)],
}
# Rows that say how an effect acts and must be silent while it is off.
COMPANIONS = [
    ("drive", "stribeck_speed_rad_s"), ("drive", "cogging_per_turn_ratio"), ("drive", "ripple_per_turn_ratio"),
    ("transmission", "eccentricity_phase_rad"), ("gas", "droop_time_s"), ("muscle", "slip1_m"), ("muscle", "slip2_m"),
    ("muscle", "slip3_m"), ("muscle", "slip4_m"), ("muscle", "slip1_ratio"), ("muscle", "slip4_ratio"),
    ("muscle", "slip_reference_length_m"), ("muscle", "dahl_m"), ("muscle", "stribeck_speed_m_s"),
    ("muscle", "lock_length_m"), ("muscle", "creep_time_s"), ("load", "guide_stiffness_n_m"),
    ("load", "knee_stiffness_nm_rad"), ("sensors", "encoder_phase_rad"), ("drive", "winding_thermal_k_w"),
]
SWITCHES = [(effect, block, row) for effect, pairs in effects().items() for block, row in pairs]


def plant_for(block: str, name: str):
    """Parameters and commands of a plant in which this row can matter."""
    if block == "load" and name in ("coulomb_n",):
        file = load_plant(PLANTS / "mass.yaml")
    else:
        file = load_plant(PLANTS / ("knee.yaml" if block == "load" or "joint" in name or "muscle1" in name or "load_pos" in name
                                    else "bench.yaml"))
    return silent(file.params), log_commands(file, SECONDS), file.substeps


BASE: dict[bytes, np.ndarray] = {}


def baseline(params, commands, substeps):
    key = params.tobytes()
    if key not in BASE:
        BASE[key] = simulate(params, commands, substeps)
    return BASE[key]


@pytest.mark.parametrize(("effect", "block", "row"), SWITCHES, ids=lambda x: getattr(x, "name", x))
def test_every_effect_moves_a_sensor_and_neutral_is_off(effect, block, row):
    params, commands, substeps = plant_for(block, row.name)
    for block_needed, name, needed in NEEDED.get(row.name, ()):
        params[block_needed][name] = needed
    before = baseline(params, commands, substeps)
    value = TYPICAL.get(row.name, 1.01 if row.name.endswith("gain_ratio") else 0.01)
    assert value != row.neutral and row.low <= value <= row.high
    params[block][row.name] = value
    after = simulate(params, commands, substeps)
    assert all(np.all(np.isfinite(after[name])) for name in SENSORS.names)
    assert after.tobytes() != before.tobytes()


@pytest.mark.parametrize(("block", "name"), COMPANIONS)
def test_what_shapes_an_effect_is_silent_while_the_effect_is_off(block, name):
    """Bit-identical output: the neutral effect is computed as if its code were not there."""
    params, commands, substeps = plant_for(block, name)
    before = baseline(params, commands, substeps)
    row = next(row for row in BLOCKS[block] if row.name == name)
    params[block][name] = min(max(params[block][name].max() * 1.7 + 0.01, row.low), row.high)
    assert simulate(params, commands, substeps).tobytes() == before.tobytes()


def test_rows_are_well_formed():
    for block, table in BLOCKS.items():
        names = [row.name for row in table]
        assert len(set(names)) == len(names), block
        for row in table:
            assert row.low <= row.neutral <= row.high, (block, row.name)
            assert row.meaning and row.source
    assert set(TWICE) <= set(BLOCKS)
