"""Runs that two simulators are held together on: effects, several at once where they do not hide
each other, and force laws.
"""

from typing import NamedTuple


class Scene(NamedTuple):
    """A plant of config/plants, what is changed in it, and the run."""

    plant: str
    knobs: dict  # each of these alone shows in a reading
    seconds: float = 1.2
    parts: int = 1  # of a cycle, in the second simulator
    prepare: object = None  # changes the commands


def three_loops(commands):
    """Ends in the torque loop and then in the speed loop, at about the speed that this has made.

    Where the current jumps by amperes, the compiled plant's two sub-steps are off by more than a
    sensor step; finer ones are not.
    """
    commands["mode"][1050:1130], commands["mode"][1130:] = 10.0, 9.0
    commands["target_torque_nm"][1050:1130], commands["target_speed_rad_s"][1050:] = 0.03, -15.0


def from_travel(commands):
    commands["target_angle_rad"] += 5.7  # the bench's 3 mm


def both_filled(commands):
    commands["inlet"][100:700, 1] = 1.0


SCENES = {
    "drive: heat, a supply that sags, waves of the torque, saturation": Scene(
        "bench_physical",
        {
            "drive.torque_loss_per_k": 2e-3,
            "drive.winding_thermal_k_w": 20.0,
            "drive.winding_time_s": 0.5,
            "drive.housing_heat_ratio": 3.0,
            "drive.housing_time_s": 8.0,
            "drive.bus_sag_ohm": 1.5,
            "drive.supply_v": 7.5,
            "drive.torque_ripple_ratio": 0.05,
            "drive.ripple_twice_sine_ratio": 0.3,
            "drive.ripple_phase_rad": 0.7,
            "drive.cogging_nm": 3e-3,
            "drive.cogging_twice_cosine_ratio": -0.4,
            "drive.torque_saturation_per_a": 0.02,
            "drive.ripple_per_turn_ratio": 7.0,
            "drive.ripple_twice_cosine_ratio": -0.4,
            "drive.cogging_per_turn_ratio": 5.0,
            "drive.cogging_phase_rad": 0.4,
            "drive.cogging_twice_sine_ratio": 0.3,
            "drive.winding_ohm": 1.2,
            "drive.feedforward_ratio": 0.9,
        },
    ),
    "a spool that is not round, creep": Scene(
        "bench_physical",
        {
            "transmission.eccentricity_ratio": 0.1,
            "transmission.eccentricity_phase_rad": 1.0,
            "transmission.wind_up_per_rad": 0.06,
            "muscle.creep_stiffness_n_m": 2000.0,
            "muscle.creep_time_s": 0.1,
            "muscle.creep_slow_ratio": 0.6,
        },
    ),
    "low-speed friction of the motor": Scene(
        "bench_physical",
        {
            "drive.stribeck_ratio": 1.5,
            "drive.presliding_stiffness_nm_rad": 0.2,
            "drive.presliding_time_s": 3e-3,
            "drive.stribeck_speed_rad_s": 30.0,
            "drive.stribeck_exponent_ratio": 0.8,
        },
    ),
    "play": Scene("bench_physical", {"transmission.backlash_rad": 0.03}),
    "uneven play": Scene(
        "bench_physical",
        {
            "transmission.uneven_backlash_rad": 0.03,
            "transmission.backlash_wave_ratio": 0.7,
            "transmission.backlash_per_turn_ratio": 2.0,
            "transmission.backlash_narrowness_ratio": 1.8,
            "transmission.backlash_phase_rad": 1.1,
        },
    ),
    "play with round flanks": Scene(
        "bench_physical",
        {"transmission.backlash_rad": 0.03, "transmission.backlash_roundness_ratio": 0.6},
    ),
    "friction of the braid": Scene(
        "bench_physical",
        {
            "muscle.stribeck_ratio": 0.05,
            "muscle.stribeck_tail_ratio": 0.5,
            "muscle.stribeck_breadth_ratio": 1.4,
            "muscle.coulomb_ratio": 0.03,
            "muscle.coulomb_speed_m_s": 0.004,
            "muscle.pressure_viscous_s_m": 0.3,
            "muscle.stribeck_speed_m_s": 0.008,
            "muscle.slip_reference_length_m": 0.14,
            "muscle.take_up_m": 2e-3,
            **{f"muscle.slip{k}_m": m for k, m in enumerate((5e-4, 8e-4, 2e-3, 7e-3), 1)},
            **{f"muscle.slip{k}_ratio": share for k, share in enumerate((0.3, 0.2, 0.3, 0.2), 1)},
        },
    ),
    "friction of the gear": Scene(
        "bench_physical",
        {
            "transmission.gear_friction_n": 12.0,
            "transmission.gear_efficiency_ratio": 0.85,
            "transmission.gear_friction_speed_rad_s": 3.0,
            "transmission.gear_friction_sharpness_ratio": 2.0,
        },
    ),
    "bladder, threshold, softening, end fittings, leak through narrow gaps": Scene(
        "bench_physical",
        {
            "muscle.bladder_stiffness_n_m": 500.0,
            "muscle.bladder_hardening_per_m": 30.0,
            "muscle.threshold_pa": 2e4,
            "muscle.softening_per_pa": 3e-7,
            "muscle.end_length_m": 2e-3,
            "gas.leak_per_s": 0.1,
            "gas.leak_laminar_ratio": 0.8,
        },
    ),
    "friction of the gear in motion alone": Scene(
        "bench_physical",
        {"transmission.gear_friction_n": 30.0, "transmission.gear_sliding_ratio": 1.0},
    ),
    "friction of the gear, half and half; valves that do not shut": Scene(
        "bench_physical",
        {
            "transmission.gear_friction_n": 10.0,
            "transmission.gear_friction_speed_rad_s": 5.0,
            "transmission.gear_sliding_ratio": 0.5,
            "gas.inlet_seat_leak_ratio": 0.06,
            "gas.exhaust_seat_leak_ratio": 0.08,
            "gas.leak_laminar_ratio": 0.9,
        },
    ),
    "lock": Scene(
        "bench_physical",
        {
            "muscle.lock_stiffness_n_m": 3000.0,
            "muscle.lock_hardening_per_m": 100.0,
            "muscle.lock_steepening_ratio": 3.0,
            "muscle.lock_viscous_n_s_m": 20.0,
            "muscle.lock_length_m": 0.1385,
        },
    ),
    "regulator that rings and bends, other for each muscle; stuck valves, limited flow, heat of the gas; uneven friction of the motor": Scene(  # noqa: E501
        "knee",
        {
            "gas.supply_droop_pa_s_kg": 4e8,
            "gas.droop_time_s": 0.03,
            "gas.droop_ring_ratio": 1.5,
            "gas.droop_bend_s_kg": 1.5e3,
            "gas1.supply_droop_pa_s_kg": 7e8,
            "gas1.supply_gauge_pa": 7e5,
            "gas.inlet_stuck_ratio": 0.15,
            "gas.exhaust_stuck_ratio": 0.3,
            "gas.flow_limit_s_kg": 300.0,
            "gas.adiabatic_ratio": 0.8,
            "gas.wall_exchange_per_s": 3.0,
            "gas.wall_exchange_fall_ratio": 0.7,
            "gas.wall_exchange_rise_ratio": 0.3,
            "gas.wall_exchange_stir_s": 0.5,
            "drive.friction_wave_ratio": 0.6,
            "drive.friction_wave_per_turn_ratio": 2.0,
            "drive.friction_wave_phase_rad": 0.8,
            "load.travel1_ratio": -0.3,
            "gas.critical_ratio": 0.45,
            "drive.viscous_asymmetry_ratio": 0.6,
            "drive.viscous_nm_s_rad": 1e-4,
        },
    ),
    "late commands of drive and valves in all loops; droop, heat of filling and compressing; law 2": Scene(  # noqa: E501
        "bench_physical",
        {
            "bus.command_delay_s": 0.0043,
            "bus.valve_delay_s": 0.0087,
            "bus.valve_skew_ratio": 0.4,
            "gas.supply_droop_pa_s_kg": 6e8,
            "gas.droop_time_s": 0.015,
            "gas.fill_heating_ratio": 1.2,
            "gas.heat_exchange_per_s": 4.0,
            "gas.compression_heating_ratio": 0.3,
            "gas.compression_cooling_per_s": 5.0,
            "muscle.law_code": 2.0,
            "muscle.poly_c5_ratio": 0.01,
            "muscle.poly_c1_ratio": 2.0,
            "muscle.poly_c2_ratio": -0.3,
            "muscle.poly_c3_ratio": 0.3,
            "muscle.poly_c4_ratio": 0.4,
            "muscle.poly_pressure_max_ratio": 0.3,
            "muscle.poly_length_max_ratio": 0.7,
            "muscle.poly_speed_max_ratio": 0.5,
            "muscle.poly_force_n": 150.0,
            "muscle.poly_length_m": 0.028,
            "muscle.poly_speed_m_s": 0.06,
            "muscle.poly_pressure_pa": 7e5,
        },
        parts=2,
        prepare=three_loops,
    ),
    "valves that open sooner than they close; law 1; another gas": Scene(
        "bench_physical",
        {
            "bus.valve_delay_s": 0.004,
            "bus.valve_skew_ratio": -0.6,
            "muscle.law_code": 1.0,
            "muscle.tang_k0_m2": 8e-5,
            "muscle.tang_k1_m": -6e-3,
            "muscle.tang_k2_ratio": 0.03,
            "muscle.tang_s0_n": 1.0,
            "muscle.tang_s1_n_m": -300.0,
            "muscle.tang_s2_n_m2": 2000.0,
            "muscle.tang_d1_n_s_m_pa": 2e-4,
            "muscle.tang_d2_n_s2_m2_pa": 3e-4,
            "muscle.tang_n0_m2": 1e-5,
            "muscle.tang_n1_m": 1e-4,
            "muscle.tang_n2_ratio": 3e-3,
            "muscle.tang_phi_pa": 1e4,
            "muscle.tang_sign_m_s": 3e-3,
            "gas.temperature_k": 310.0,
            "gas.gas_constant_j_kg_k": 260.0,
            "gas.valve_lag_s": 6e-3,
            "gas.atmosphere_pa": 9.4e4,
        },
        seconds=0.7,
    ),
    "strap; braid friction of Dahl, LuGre, Bouc-Wen, Preisach, run-in; stretched at rest": Scene(
        "bench_physical",
        {
            "muscle.strap_compliance_m_n": 2e-5,
            "muscle.strap_stiffening_per_n": 0.01,
            "muscle.dahl_ratio": 0.05,
            "muscle.dahl_m": 2e-3,
            "muscle.lugre_ratio": 0.06,
            "muscle.lugre_m": 1.5e-3,
            "muscle.lugre_extra_ratio": 0.8,
            "muscle.lugre_speed_m_s": 0.02,
            "muscle.bouc_wen_ratio": 0.07,
            "muscle.bouc_wen_m": 2e-3,
            "muscle.bouc_wen_exponent_ratio": 3.0,
            "muscle.bouc_wen_unload_ratio": 0.8,
            "muscle.preisach_ratio": 0.06,
            "muscle.preisach_m": 3e-3,
            "muscle.preisach_slope_per_m": 40.0,
            "muscle.run_in_ratio": 0.08,
            "muscle.run_in_m": 0.03,
            "muscle.bladder_stiffness_n_m": 500.0,
            "load.start_travel_m": 3e-3,
        },
        prepare=from_travel,
    ),
    "lever, springs, hang and dry friction of the knee; a bladder that pulls at rest": Scene(
        "knee",
        {
            "load.lever_slope_per_rad": 0.3,
            "load.lever_curve_per_rad2": -1.2,
            "load.knee_spring_nm_rad": 3.0,
            "load.misalignment_rad": 0.06,
            "load.knee_coulomb_nm": 0.8,
            "load.knee_stiffness_nm_rad": 60.0,
            "load.knee_bend_ratio": 0.8,
            "muscle1.bladder_stiffness_n_m": 800.0,
            "muscle.threshold_pa": 1e4,
        },
    ),
    "friction of a mass on a line": Scene(
        "mass",
        {
            "load.coulomb_n": 15.0,
            "load.payload_kg": 0.4,
            "load.viscous_n_s_m": 8.0,
            "load.guide_stiffness_n_m": 8000.0,
            "load.presliding_time_s": 4e-3,
        },
        seconds=0.7,
    ),
    "sensors: late, lagging, shaken, crosstalk, bows, drifts, gains, zeros; friction that the knee builds up": Scene(  # noqa: E501
        "knee",
        {
            "sensors.gauge_skew_s": 7.3e-3,
            "sensors.gauge_lag_s": 4e-3,
            "sensors.force_skew_s": 3.6e-3,
            "sensors.encoder_skew_s": 2.5e-3,
            "sensors.joint_skew_s": 5.2e-3,
            "sensors.force_lag_s": 6e-3,
            "sensors.frame_mode_ratio": 0.6,
            "sensors.frame_hz": 14.0,
            "sensors.frame_damping_ratio": 0.1,
            "sensors.encoder_hold_s": 3e-3,
            "sensors.pressure_lag_s": 5e-3,
            "sensors.encoder_eccentricity_rad": 0.02,
            "sensors.encoder_phase_rad": 0.7,
            "sensors.encoder_twice_sine_ratio": 0.4,
            "sensors.encoder_twice_cosine_ratio": -0.3,
            "sensors.muscle0_gauge_drift_pa": 2e4,
            "sensors.muscle1_gauge_drift_pa": -2e4,
            "sensors.gauge_warm_up_s": 2.0,
            "sensors.force_drift_n": 5.0,
            "sensors.force_warm_up_s": 1.0,
            "sensors.force_crosstalk_n_pa": 1e-5,
            "sensors.gauge_crosstalk_pa_n": 60.0,
            "sensors.force_bow_per_n": 6e-4,
            "sensors.muscle0_gauge_bow_per_pa": 1.9e-7,
            "sensors.muscle1_gauge_bow_per_pa": -6e-8,
            **{
                f"sensors.{name}_gain_ratio": gain
                for name, gain in {
                    "motor_angle": 1.01,
                    "motor_speed": 0.98,
                    "motor_current": 1.05,
                    "motor_torque": 1.02,
                    "muscle0_gauge": 1.04,
                    "muscle1_gauge": 0.96,
                    "supply_gauge": 1.02,
                    "force": 0.95,
                    "joint_angle": 1.03,
                    "joint_speed": 0.92,
                    "load_position": 1.02,
                }.items()
            },
            "sensors.motor_angle_offset_rad": 0.01,
            "sensors.motor_speed_offset_rad_s": 0.5,
            "sensors.motor_current_offset_a": 0.05,
            "sensors.motor_torque_offset_nm": 1e-3,
            "sensors.muscle0_gauge_offset_pa": 3e3,
            "sensors.muscle1_gauge_offset_pa": -4e3,
            "sensors.supply_gauge_offset_pa": 5e3,
            "sensors.force_offset_n": 1.5,
            "sensors.joint_angle_offset_rad": 0.01,
            "sensors.joint_speed_offset_rad_s": -0.3,
            "sensors.load_position_offset_m": 2e-4,
            "gas.supply_droop_pa_s_kg": 3e8,
            "gas1.atmosphere_pa": 9.7e4,
            "load.knee_coulomb_nm": 0.8,
            "load.knee_friction_speed_rad_s": 0.1,
        },
        prepare=both_filled,
    ),
    "a weight on the shin": Scene(
        "knee", {"load.payload_kg": 0.3, "load.payload_lever_ratio": 1.6}
    ),
    "less weight on the shin": Scene("knee", {"load.payload_kg": -0.2}),
}
