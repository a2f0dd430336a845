"""Plants drawn within engineering ranges: what a real rig of the same kind may be like.

Ranges are engineering estimates of docs/plant.md and docs/effects.md; each effect is there with
probability one half, its strength drawn evenly between its ends.
"""

from dataclasses import replace

import numpy as np

from epa_rt.models.catalogue import NOMINAL
from epa_rt.models.knobs import read_knob, write_knob
from epa_rt.models.plant_file import PlantFile

PRESENT = 0.5
NOMINAL_MOST = 2.0  # of its standard deviations, a nominal parameter is off at most
# The model takes the strap's stretch from the force of the sub-step before (docs/plant.md): it
# swings up where compliance times the muscle's stiffness reaches 1, which no real strap does.
STRAP_SHARE = 0.6
LOCK_N_M = 2e4  # the softest of braid locks: beside a soft strap the stiff ones are not drawn
DROOP = "gas.supply_droop_pa_s_kg"  # drawn in Pa, at the flow of all inlets open
# one effect a line: rows of the plant, each from and to
RANGES: tuple[tuple[tuple[str, float, float], ...], ...] = (
    (("gas.polytropic_ratio", 1.0, 1.4),),
    (("gas.leak_per_s", 1e-5, 5e-4),),
    (("gas.dead_volume_m3", 1e-6, 20e-6),),
    (("gas.fill_heating_ratio", 1.0, 1.4), ("gas.heat_exchange_per_s", 0.05, 1.0)),
    ((DROOP, 5e3, 50e3), ("gas.droop_time_s", 0.01, 0.1)),
    (("gas.flow_limit_s_kg", 0.0, 1500.0),),
    (("bus.valve_delay_s", 0.005, 0.030),),
    (("bus.command_delay_s", 0.0, 0.003),),
    (("muscle.strap_compliance_m_n", 5e-6, 3.3e-5),),
    (("muscle.slip_ratio", 0.01, 0.10),),
    (("muscle.stribeck_ratio", 0.003, 0.03), ("muscle.stribeck_speed_m_s", 1e-3, 20e-3)),
    (("muscle.creep_stiffness_n_m", 30.0, 300.0), ("muscle.creep_time_s", 0.1, 100.0)),
    (("muscle.bladder_stiffness_n_m", 0.0, 600.0),),
    (("muscle.threshold_pa", 0.0, 80e3),),
    (("muscle.end_length_m", -2e-3, 2e-3),),
    (("sensors.pressure_lag_s", 1e-3, 30e-3),),
    (("sensors.gauge_skew_s", 0.0, 0.010),),
    (("sensors.force_skew_s", 0.0, 0.010),),
    (("sensors.joint_skew_s", 0.0, 0.005),),
    (("sensors.muscle0_gauge_gain_ratio", 0.995, 1.005),),
    (("sensors.muscle1_gauge_gain_ratio", 0.995, 1.005),),
    (("sensors.muscle0_gauge_offset_pa", -5e3, 5e3),),
    (("sensors.muscle1_gauge_offset_pa", -5e3, 5e3),),
    (("sensors.force_gain_ratio", 0.99, 1.01),),
    (("sensors.force_offset_n", -3.0, 3.0),),
    (("sensors.motor_current_gain_ratio", 0.99, 1.01),),
    (("sensors.motor_current_offset_a", -0.02, 0.02),),
    (("sensors.joint_angle_gain_ratio", 0.995, 1.005),),
    (("sensors.load_position_gain_ratio", 0.995, 1.005),),
    (("sensors.force_noise_n", 0.0, 2.4),),
    (("sensors.frame_mode_ratio", 0.2, 1.0), ("sensors.frame_hz", 8.0, 40.0)),
    (("sensors.encoder_eccentricity_rad", 3.5e-4, 3.5e-3),),
    (("transmission.backlash_rad", 1.7e-3, 17e-3),),
    (("transmission.gear_efficiency_ratio", 0.6, 0.85),),
    (("transmission.gear_friction_n", 1.0, 10.0),),
    (("drive.cogging_nm", 1e-3, 5e-3), ("drive.cogging_per_turn_ratio", 4.0, 84.0)),
    (("drive.torque_ripple_ratio", 0.01, 0.05), ("drive.ripple_per_turn_ratio", 6.0, 12.0)),
    (("drive.bus_sag_ohm", 0.1, 0.5),),
    (("drive.torque_loss_per_k", 1e-3, 2e-3),),
    (("load.misalignment_rad", -0.05, 0.05),),
    (("load.payload_kg", -0.1, 0.1),),
    (("load.lever_slope_per_rad", -0.2, 0.2),),
    (("load.knee_coulomb_nm", 0.01, 0.2),),
    (("load.coulomb_n", 0.5, 3.0),),
)


def drawn_plant(plant: PlantFile, seed: int) -> PlantFile:
    """A plant like this one, with other values; ``seed`` 0 is the plant itself."""
    if seed == 0:
        return plant
    rng, params = np.random.default_rng([seed, 56]), plant.params.copy()
    for nominal in NOMINAL:
        off = float(np.clip(rng.normal(), -NOMINAL_MOST, NOMINAL_MOST))
        value = read_knob(params, nominal.key)
        write_knob(params, nominal.key, max(value * (1.0 + off * nominal.relative), 0.0))
    for effect in RANGES:
        present = rng.uniform() < PRESENT
        for key, low, high in effect:
            value = float(rng.uniform(low, high))
            if key == DROOP:
                value /= _flow_kg_s(params)
            if present:
                write_knob(params, key, value)
    _strap_that_the_model_can(params)
    return replace(plant, params=params)


def _strap_that_the_model_can(params: np.ndarray) -> None:
    """Limits the strap's compliance to what the explicit model of it follows."""
    muscle, gas = params["muscle"][0][0], params["gas"][0][0]
    compliance = float(muscle["strap_compliance_m_n"])
    if compliance == 0.0:
        return
    locks = 0.0
    if muscle["lock_stiffness_n_m"] != 0.0:
        write_knob(params, "muscle.lock_stiffness_n_m", LOCK_N_M)
        locks = LOCK_N_M
    length, braid = float(muscle["slip_reference_length_m"]), float(muscle["braid_length_m"])
    spread = 4.0 * np.pi * float(muscle["braid_turns_ratio"]) ** 2
    pull_n = float(gas["supply_gauge_pa"]) * (3.0 * length * length - braid * braid) / spread
    slips = sum(
        float(muscle[f"slip{i}_ratio"]) / float(muscle[f"slip{i}_m"]) for i in range(1, 5)
    ) * (float(muscle["slip_ratio"]) * pull_n)
    springs = float(gas["supply_gauge_pa"]) * 6.0 * length / spread
    most = STRAP_SHARE / (locks + slips + springs)
    write_knob(params, "muscle.strap_compliance_m_n", min(compliance, most))


def _flow_kg_s(params: np.ndarray) -> float:
    """What flows through all inlets at once, choked (ISO 6358)."""
    gas = params["gas"][0]
    absolute_pa = float(np.max(gas["supply_gauge_pa"] + gas["atmosphere_pa"]))
    inlets = int(np.sum(params["muscle"]["present"][0] > 0.5))
    return inlets * float(np.max(gas["inlet_conductance_m3_s_pa"])) * 1.185 * absolute_pa
