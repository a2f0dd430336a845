"""The hidden effects: which fields of the stand-in each switches on, and what a diagnosis would have to call it.

``answers`` are names of the catalogue that mean this very thing; their families follow from the catalogue. Empty: the
catalogue never had it. ``blocks``: where it sits; more than one where no measurement of these rigs can tell them apart, or
where a sensor's fault is at first seen in the block whose output it reads.
"""

from typing import NamedTuple

BOTH = ("bench", "knee")
BENCH, KNEE = ("bench",), ("knee",)
PRE_SLIDING = ("braid_maxwell_slip", "braid_dahl", "braid_lugre", "braid_bouc_wen", "braid_coulomb", "braid_preisach")
MOTOR = ("drive", "transmission")
TURN = (-3.14, 3.14)


class Hidden(NamedTuple):
    """``field``: strength (0: off), ``typical`` in its unit, at most ``most``. ``shapes``: fields drawn between two values.

    ``either_sign``: the strength may be negative. ``rivals``: other hidden effects that it is easily taken for.
    """

    name: str
    field: str
    typical: float
    most: float
    answers: tuple[str, ...]
    blocks: tuple[str, ...]
    law: str
    rigs: tuple[str, ...] = BOTH
    shapes: tuple[tuple[str, float, float], ...] = ()
    either_sign: bool = False
    rivals: tuple[str, ...] = ()


H = Hidden
_MOTOR_AND_GEAR: tuple[Hidden, ...] = (
    H("late_command", "pade_s", 3e-3, 0.02, ("transport_delay",), ("bus", "drive"), "Pade all-pass on the targets", rivals=("old_encoder",)),
    H("late_valves", "valve_open_s", 0.015, 0.05, ("valve_dead_time",), ("bus", "gas"), "opens late, closes less late",
      shapes=(("valve_close_ratio", 0.7, 1.0),), rivals=("slow_gauge", "thermal_gas")),
    H("shaft_stribeck", "stribeck_nm", 1e-3, 0.01, ("motor_stribeck",), MOTOR, "rational fall over speed",
      shapes=(("stribeck_rad_s", 8.0, 40.0),), rivals=("dry_gear", "rub")),
    H("cogs", "cogging_nm", 4e-3, 0.02, ("cogging",), ("drive",), "sine and second harmonic, any phase",
      shapes=(("cogging_phase_rad", *TURN),), rivals=("ripple",)),
    H("ripple", "ripple_ratio", 0.04, 0.3, ("torque_ripple",), ("drive",), "rectified sines, six a turn",
      shapes=(("ripple_phase_rad", *TURN),), rivals=("cogs",)),
    H("sagging_supply", "sag_ohm", 0.5, 3.0, ("bus_sag",), ("drive",), "sags with the power drawn"),
    H("warm_magnets", "heat_loss_per_k", 2e-3, 0.01, ("torque_constant_heat",), ("drive",), "winding and housing, exponential loss"),
    H("windage", "windage_nm_s2", 4e-8, 2e-6, (), MOTOR, "drag with the speed squared", rivals=("dry_gear", "mesh_loss")),
    H("rub", "rub_nm", 2e-3, 0.01, ("motor_friction_wave",), MOTOR, "dry friction that comes and goes over the spool's turn",
      shapes=(("rub_phase_rad", *TURN),), rivals=("dry_gear", "mesh_loss")),
    H("mesh_loss", "mesh_loss_ratio", 0.15, 0.5, ("gear_efficiency",), MOTOR, "smooth friction proportional to load",
      rivals=("dry_gear", "shaft_stribeck")),
    H("dry_gear", "gear_dry_n", 8.0, 40.0, ("gear_friction",), MOTOR, "tanh of the speed",
      shapes=(("gear_smooth_rad_s", 1.5, 6.0),), rivals=("mesh_loss", "shaft_stribeck")),
    H("play", "play_m", 1e-4, 1.5e-3, ("backlash",), ("transmission",), "three plays beside each other",
      rivals=("braid_elements", "soft_strap")),
    H("wobbling_spool", "wobble_ratio", 0.03, 0.15, ("spool_eccentricity",), ("transmission",), "first and second harmonic",
      shapes=(("wobble_phase_rad", *TURN),), rivals=("layers",)),
    H("layers", "layer_per_rad", 0.01, 0.06, ("spool_wind_up", "spool_eccentricity"), ("transmission",), "radius grows with every layer",
      rivals=("wobbling_spool",)),
)
_GAS: tuple[Hidden, ...] = (
    H("laminar_leak", "leak_per_s", 1e-3, 0.05, ("leak", "valve_seat_leak"), ("gas",), "squared pressures",
      rivals=("gauge_drift", "leaking_inlet")),
    H("leaking_inlet", "seat_in_ratio", 5e-4, 0.02, ("valve_seat_leak",), ("gas",), "laminar gap of the shut inlet",
      rivals=("laminar_leak", "gauge_drift")),
    H("leaking_exhaust", "seat_out_ratio", 5e-4, 0.02, ("valve_seat_leak", "leak"), ("gas",), "laminar gap of the shut exhaust",
      rivals=("laminar_leak", "gauge_drift")),
    H("thermal_gas", "gas_time_s", 0.1, 2.0, ("compression_heat", "polytropic", "fill_heat"), ("gas",),
      "energy balance, natural convection to the walls", rivals=("slow_gauge", "laminar_leak")),
    H("soft_regulator", "regulator_pa_s_kg", 1.5e8, 1e9, ("supply_droop",), ("gas",), "regulator of second order",
      shapes=(("regulator_hz", 2.0, 8.0),), rivals=("late_valves",)),
    H("swelling_tube", "swell_per_pa", 5e-7, 1e-5, (), ("gas",), "the dead volume grows with pressure",
      rivals=("thermal_gas", "gauge_scale")),
    H("hose", "hose_pa_s_kg", 2e7, 5e8, (), ("sensors", "gas"), "a reading off by what the flow loses in a hose between gauge and muscle",
      rivals=("slow_gauge", "late_valves", "soft_regulator")),
)
_MUSCLE: tuple[Hidden, ...] = (
    H("braid_elements", "slip_ratio", 0.05, 0.25, PRE_SLIDING, ("muscle",), "eight slip elements, break-aways spaced by two",
      shapes=(("slip_m", 1e-4, 4e-4),), rivals=("relaxing_braid", "soft_strap", "play")),
    H("braid_bouc", "bouc_ratio", 0.05, 0.25, PRE_SLIDING, ("muscle",), "Bouc-Wen, exponent 2",
      shapes=(("bouc_m", 5e-4, 3e-3),), rivals=("relaxing_braid", "soft_strap")),
    H("braid_bristles", "lugre_ratio", 0.05, 0.25, PRE_SLIDING, ("muscle",), "LuGre with a rise at low speed",
      shapes=(("lugre_m", 3e-4, 2e-3), ("lugre_rise_ratio", 0.1, 0.4)), rivals=("relaxing_braid", "braid_low_speed")),
    H("braid_tanh", "coulomb_ratio", 0.05, 0.25, PRE_SLIDING, ("muscle",), "tanh of the speed",
      shapes=(("coulomb_m_s", 0.0005, 0.002),), rivals=("braid_low_speed", "wet_braid")),
    H("braid_low_speed", "lowspeed_ratio", 0.02, 0.2, ("braid_stribeck",), ("muscle",), "a peak over speed with a long tail",
      shapes=(("lowspeed_m_s", 0.003, 0.012),), rivals=("braid_tanh", "wet_braid")),
    H("rubber_wall", "wall_n_m", 300.0, 2000.0, ("bladder_spring",), ("muscle",), "hardening spring",
      shapes=(("wall_rise_per_m", 2.0, 20.0),), rivals=("rubber_threshold", "end_cones", "force_scale", "soft_braid")),
    H("rubber_threshold", "threshold_pa", 2e4, 1e5, ("threshold_pressure",), ("muscle",), "fades in exponentially",
      rivals=("gauge_zero", "rubber_wall", "soft_braid")),
    H("end_cones", "end_m", 1e-3, 0.004, ("end_fittings",), ("muscle",), "braid longer or shorter than its line", either_sign=True,
      rivals=("rubber_wall", "force_scale")),
    H("exponential_lock", "lock_n", 5.0, 60.0, ("braid_lock",), ("muscle",), "exponential past a length", BENCH,
      shapes=(("lock_m", 0.136, 0.142), ("lock_scale_m", 0.0015, 0.003)), rivals=("rubber_wall",)),
    H("soft_strap", "strap_m", 1e-3, 0.006, ("strap_compliance",), ("muscle",), "stiffens exponentially",
      shapes=(("strap_n", 80.0, 200.0),), rivals=("end_cones", "rubber_wall", "swinging_frame", "play")),
    H("relaxing_braid", "relax_n_m", 300.0, 4000.0, ("creep",), ("muscle",), "three relaxations, a decade apart",
      shapes=(("relax_s", 0.5, 5.0),), rivals=("braid_elements", "force_drift", "thermal_gas")),
    H("wet_braid", "wet_s_m_pa", 2e-5, 3e-4, ("braid_pressure_viscous",), ("muscle",), "damping grows with pressure",
      rivals=("braid_low_speed", "braid_tanh", "slow_force")),
    H("soft_braid", "soften_per_pa", 1e-7, 6e-7, ("pull_softening",), ("muscle",), "pull falls behind at high pressure",
      rivals=("rubber_threshold", "rubber_wall", "force_scale", "gauge_scale")),
    H("swinging_frame", "frame_m_n", 3e-6, 3e-5, ("frame_mode", "strap_compliance"), ("sensors", "muscle", "load"),
      "mass and spring behind the load cell", BENCH, shapes=(("frame_hz", 9.0, 25.0),), rivals=("soft_strap",)),
)
_LOAD: tuple[Hidden, ...] = (
    H("knee_rubs", "knee_dry_nm", 0.08, 0.4, ("knee_friction",), ("load",), "tanh of the speed", KNEE,
      shapes=(("knee_dry_rad_s", 0.01, 0.05),), rivals=("knee_bristles",)),
    H("knee_bristles", "knee_bristle_nm", 0.08, 0.4, ("knee_friction",), ("load",), "bristles that bend", KNEE,
      shapes=(("knee_bristle_rad", 0.002, 0.01),), rivals=("knee_rubs", "braid_elements")),
    H("cuff", "payload_kg", 0.1, 0.6, ("payload",), ("load",), "a mass off the shank's centre", KNEE,
      shapes=(("payload_lever_m", 0.12, 0.3),), rivals=("tilt", "arm")),
    H("tilt", "tilt_rad", 0.03, 0.15, ("gravity_misalignment",), ("load",), "the frame leans", KNEE, either_sign=True,
      rivals=("cuff", "arm", "joint_zero", "knee_ligament")),
    H("arm", "arm_slope_per_rad", 0.2, 0.8, ("moment_arm",), ("load",), "slope and curvature", KNEE,
      shapes=(("arm_curve_per_rad", -1.0, 1.0),), either_sign=True, rivals=("cuff", "tilt", "knee_ligament")),
    H("knee_air", "knee_air_nm_s2", 0.05, 2.0, (), ("load",), "drag with the speed squared", KNEE, rivals=("knee_rubs",)),
    H("knee_ligament", "knee_spring_nm_rad", 0.5, 5.0, ("knee_spring",), ("load",), "a passive spring of the joint", KNEE,
      rivals=("arm", "cuff", "tilt")),
)
_SENSORS: tuple[Hidden, ...] = (
    H("slow_gauge", "pressure_time_s", 0.008, 0.05, ("gauge_skew", "gauge_lag"), ("sensors", "gas"),
      "a second lag behind the first", rivals=("thermal_gas", "late_valves")),
    H("gauge_scale", "pressure_gain_ratio", 0.005, 0.08, ("muscle0_gauge_gain",), ("sensors", "gas", "muscle"), "scale", either_sign=True,
      rivals=("force_scale", "gauge_zero")),
    H("gauge_zero", "pressure_offset_pa", 4e3, 3e4, ("muscle0_gauge_offset",), ("sensors", "gas", "muscle"), "zero", either_sign=True,
      rivals=("rubber_threshold", "gauge_scale")),
    H("gauge_drift", "pressure_drift_pa", 4e3, 3e4, ("muscle0_gauge_drift",), ("sensors", "gas", "muscle"),
      "exponential and slope", shapes=(("drift_time_s", 6.0, 25.0),), either_sign=True, rivals=("laminar_leak", "gauge_zero")),
    H("sticking_gauge", "pressure_stick_pa", 4e3, 4e4, (), ("sensors", "gas", "muscle"), "dead band of the reading",
      rivals=("slow_gauge", "thermal_gas")),
    H("force_scale", "force_gain_ratio", 0.005, 0.1, ("force_gain",), ("sensors", "muscle"), "scale", either_sign=True,
      rivals=("gauge_scale", "rubber_wall")),
    H("force_zero", "force_offset_n", 1.0, 20.0, ("force_offset",), ("sensors", "muscle"), "zero", either_sign=True,
      rivals=("force_drift", "end_cones")),
    H("force_drift", "force_drift_n", 1.0, 15.0, ("force_drift",), ("sensors", "muscle"), "exponential and slope",
      shapes=(("drift_time_s", 6.0, 25.0),), either_sign=True, rivals=("force_zero", "relaxing_braid")),
    H("bent_force", "force_bend_per_n", 5e-5, 8e-4, ("force_bow",), ("sensors", "muscle"), "square term", either_sign=True,
      rivals=("force_scale", "rubber_wall", "soft_braid")),
    H("force_feels_pressure", "force_cross_n_pa", 2e-6, 4e-5, ("force_crosstalk",), ("sensors", "muscle"),
      "pressure pulls at the load cell", either_sign=True, rivals=("force_zero", "rubber_threshold", "end_cones")),
    H("slow_force", "force_time_s", 0.01, 0.08, ("force_lag", "force_skew"), ("sensors", "muscle"), "first-order lag",
      rivals=("wet_braid", "old_encoder")),
    H("current_scale", "current_gain_ratio", 0.02, 0.2, ("motor_current_gain",), ("sensors", "drive"), "scale", either_sign=True,
      rivals=("mesh_loss", "warm_magnets")),
    H("current_zero", "current_offset_a", 0.03, 0.5, ("motor_current_offset",), ("sensors", "drive"), "zero", either_sign=True),
    H("wobbling_encoder", "encoder_wobble_rad", 3e-3, 0.05, ("encoder_eccentricity",), ("sensors", "drive", "transmission"),
      "first and second harmonic", shapes=(("encoder_phase_rad", *TURN),), rivals=("cogs",)),
    H("old_encoder", "encoder_age_s", 0.004, 0.03, ("encoder_skew",),
      ("sensors", "drive", "bus", "muscle"), "readings some time old", rivals=("late_command", "slow_force")),
    H("joint_scale", "joint_gain_ratio", 0.01, 0.1, ("joint_angle_gain",), ("sensors", "load"), "scale", KNEE, either_sign=True,
      rivals=("arm", "joint_zero", "tilt", "knee_ligament")),
    H("joint_zero", "joint_offset_rad", 0.008, 0.08, ("joint_angle_offset",), ("sensors", "load"), "zero", KNEE, either_sign=True,
      rivals=("tilt", "end_cones", "knee_ligament")),
    H("bent_joint", "joint_bend_per_rad", 0.1, 0.8, (), ("sensors", "load"), "square term of the potentiometer", KNEE, either_sign=True,
      rivals=("joint_scale", "arm", "joint_zero")),
)
# Other formulas for what the catalogue has come near since the first were written (docs/blind-benchmark.md): drawn in their place.
SECOND: dict[str, Hidden] = {
    "warm_magnets": H("magnets_in_still_air", "heat_loss_per_k", 2e-3, 0.01, ("torque_constant_heat",), ("drive",),
                      "winding and housing, which gives its heat to still air with the power 5/4", shapes=(("convection_k", 2.0, 30.0),)),
    "play": H("uneven_play", "play_m", 1e-4, 1.5e-3, ("backlash",), ("transmission",), "a play that is wider on one side of the spool",
              shapes=(("play_spread_ratio", 0.0, 0.1), ("play_uneven_ratio", 0.3, 0.8), ("play_phase_rad", *TURN)),
              rivals=("braid_elements", "soft_strap")),
    "braid_low_speed": H("braid_bell", "bell_ratio", 0.02, 0.2, ("braid_stribeck",), ("muscle",), "a bell over the logarithm of speed",
                         shapes=(("bell_m_s", 0.003, 0.012), ("bell_width", 0.8, 1.8)), rivals=("braid_tanh", "wet_braid")),
    "relaxing_braid": H("power_law_braid", "power_n_m", 300.0, 4000.0, ("creep",), ("muscle",), "relaxes with a power of time over four decades",
                        shapes=(("power_exponent", 0.1, 0.4),), rivals=("braid_elements", "force_drift", "thermal_gas")),
}
# A third where the catalogue has caught up with the second.
THIRD: dict[str, Hidden] = {
    "play": H("worn_spots", "play_m", 1e-4, 1.5e-3, ("backlash",), ("transmission",), "a play that is wider in five worn spots of the spool's turn",
              shapes=(("play_spread_ratio", 0.0, 0.1), ("play_worn_ratio", 0.5, 1.5), ("play_worn_sharpness", 2.0, 6.0), ("play_phase_rad", *TURN)),
              rivals=("braid_elements", "soft_strap")),
}
# A fourth likewise: gas that flows in or out stirs what the walls cool.
FOURTH: dict[str, Hidden] = {
    "thermal_gas": H("stirred_gas", "gas_time_s", 0.1, 2.0, ("compression_heat", "polytropic", "fill_heat"), ("gas",),
                     "energy balance, natural convection to the walls that grows with the flow", shapes=(("stir_s", 0.3, 2.0),), rivals=("slow_gauge", "laminar_leak")),
}
# A fifth: a regulator whose seat chokes, so that it loses more to the next gram than to the last, and whose damping is drawn.
FIFTH: dict[str, Hidden] = {
    "soft_regulator": H("choking_regulator", "regulator_pa_s_kg", 1.0e8, 7e8, ("supply_droop",), ("gas",), "regulator of second order whose droop bends upwards with the flow",
                        shapes=(("regulator_hz", 2.0, 8.0), ("regulator_damping", 0.3, 0.8), ("regulator_curve_s_kg", 1500.0, 5000.0)), rivals=("late_valves",)),
}
# A sixth: bristles of the knee that hardly give until they are near sliding.
SIXTH: dict[str, Hidden] = {
    "knee_bristles": H("knee_grips", "knee_bristle_nm", 0.08, 0.4, ("knee_friction",), ("load",), "bristles that hardly give until they are near sliding", KNEE,
                       shapes=(("knee_bristle_rad", 0.002, 0.01), ("knee_bristle_power", 1.5, 4.0)), rivals=("knee_rubs", "braid_elements")),
}
LATER: tuple[dict[str, Hidden], ...] = ({}, SECOND, THIRD, FOURTH, FIFTH, SIXTH)
# by the number that `--laws` takes: what is drawn in the place of which first formula, the newest up to there
IN_PLACE: dict[int, dict[str, Hidden]] = {n: {first: other for laws in LATER[:n] for first, other in laws.items()} for n in range(1, len(LATER) + 1)}
EFFECTS: tuple[Hidden, ...] = (*_MOTOR_AND_GEAR, *_GAS, *_MUSCLE, *_LOAD, *_SENSORS)
BY_NAME: dict[str, Hidden] = {effect.name: effect for effects in (EFFECTS, *(laws.values() for laws in LATER)) for effect in effects}
