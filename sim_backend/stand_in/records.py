"""The stand-in's records: hidden parameters beside the nominal ones, and its state."""

import numpy as np

from epa_rt.models.parameters import PARAMS

# name, value that shapes the effect while it is off (0 for the strengths themselves)
HIDDEN_FIELDS: tuple[tuple[str, float], ...] = (
    # bus and valves
    ("pade_s", 0.0),
    ("valve_open_s", 0.0),
    ("valve_close_ratio", 0.6),
    # drive
    ("stribeck_nm", 0.0),
    ("stribeck_rad_s", 15.0),
    ("cogging_nm", 0.0),
    ("cogging_phase_rad", 0.0),
    ("ripple_ratio", 0.0),
    ("ripple_phase_rad", 0.0),
    ("sag_ohm", 0.0),
    ("heat_loss_per_k", 0.0),
    ("housing_k_w", 2.5),
    ("housing_time_s", 25.0),
    ("convection_k", 0.0),
    ("windage_nm_s2", 0.0),
    ("rub_nm", 0.0),
    ("rub_phase_rad", 0.0),
    # transmission
    ("mesh_loss_ratio", 0.0),
    ("gear_dry_n", 0.0),
    ("gear_smooth_rad_s", 3.0),
    ("play_m", 0.0),
    ("play_spread_ratio", 0.4),
    ("play_uneven_ratio", 0.0),
    ("play_phase_rad", 0.0),
    ("play_worn_ratio", 0.0),
    ("play_worn_sharpness", 4.0),
    ("wobble_ratio", 0.0),
    ("wobble_phase_rad", 0.0),
    ("layer_per_rad", 0.0),
    # gas
    ("leak_per_s", 0.0),
    ("gas_time_s", 0.0),
    ("stir_s", 0.0),
    ("regulator_pa_s_kg", 0.0),
    ("regulator_hz", 4.0),
    ("regulator_damping", 0.5),
    ("regulator_curve_s_kg", 0.0),
    ("seat_in_ratio", 0.0),
    ("seat_out_ratio", 0.0),
    ("swell_per_pa", 0.0),
    ("hose_pa_s_kg", 0.0),
    # muscle
    ("slip_ratio", 0.0),
    ("slip_m", 2e-4),
    ("bouc_ratio", 0.0),
    ("bouc_m", 1.5e-3),
    ("lugre_ratio", 0.0),
    ("lugre_m", 4e-4),
    ("lugre_speed_m_s", 0.01),
    ("lugre_rise_ratio", 0.4),
    ("coulomb_ratio", 0.0),
    ("coulomb_m_s", 0.002),
    ("lowspeed_ratio", 0.0),
    ("lowspeed_m_s", 0.006),
    ("wall_n_m", 0.0),
    ("wall_rise_per_m", 15.0),
    ("threshold_pa", 0.0),
    ("end_m", 0.0),
    ("lock_n", 0.0),
    ("lock_m", 0.142),
    ("lock_scale_m", 0.002),
    ("strap_m", 0.0),
    ("strap_n", 120.0),
    ("relax_n_m", 0.0),
    ("relax_s", 3.0),
    ("bell_ratio", 0.0),
    ("bell_m_s", 0.006),
    ("bell_width", 1.2),
    ("power_n_m", 0.0),
    ("power_exponent", 0.2),
    ("wet_s_m_pa", 0.0),
    ("soften_per_pa", 0.0),
    ("frame_m_n", 0.0),
    ("frame_hz", 18.0),
    ("frame_damping_ratio", 0.08),
    # load
    ("knee_dry_nm", 0.0),
    ("knee_dry_rad_s", 0.02),
    ("knee_bristle_nm", 0.0),
    ("knee_bristle_rad", 0.004),
    ("knee_bristle_power", 1.0),
    ("payload_kg", 0.0),
    ("payload_lever_m", 0.2),
    ("tilt_rad", 0.0),
    ("arm_slope_per_rad", 0.0),
    ("arm_curve_per_rad", 0.0),
    ("knee_spring_nm_rad", 0.0),
    ("knee_air_nm_s2", 0.0),
    # sensors
    ("pressure_time_s", 0.0),
    ("pressure_gain_ratio", 0.0),
    ("pressure_offset_pa", 0.0),
    ("pressure_drift_pa", 0.0),
    ("pressure_stick_pa", 0.0),
    ("force_gain_ratio", 0.0),
    ("force_offset_n", 0.0),
    ("force_drift_n", 0.0),
    ("drift_time_s", 12.0),
    ("force_bend_per_n", 0.0),
    ("force_cross_n_pa", 0.0),
    ("force_time_s", 0.0),
    ("current_gain_ratio", 0.0),
    ("current_offset_a", 0.0),
    ("encoder_wobble_rad", 0.0),
    ("encoder_phase_rad", 0.0),
    ("encoder_age_s", 0.0),
    ("joint_gain_ratio", 0.0),
    ("joint_offset_rad", 0.0),
    ("joint_bend_per_rad", 0.0),
)
HIDDEN = np.dtype([(name, "f8") for name, _ in HIDDEN_FIELDS], align=True)
STAND_IN = np.dtype(
    [(name, PARAMS.fields[name][0]) for name in PARAMS.names] + [("hidden", HIDDEN)], align=True
)

# what the integrator moves: indices into the state's ``y``
ANGLE, SPEED, CURRENT, INTEGRAL, STUCK, HEAT, HOUSING = range(7)
PLACE, RATE, KNEE_BRISTLE, FLOW, FLOW_RATE, FRAME, FRAME_RATE = range(7, 14)
PRESSURE, MASS, BOUC, LUGRE = 16, 18, 20, 22  # two each, one per muscle
RELAX = 24  # three per muscle
OPEN = 30  # inlet 0, inlet 1, exhaust 0, exhaust 1
PADE = 34  # target angle, slope, speed
LAG, LAG2 = 37, 40  # three pressure sensors each
FORCE_LAG = 43
POWER = 44  # nine per muscle
STATES = 62
POWERS, APART = 9, 3.1622776601683795  # half a decade apart
ELEMENTS = 8  # slip elements of one muscle
RING = 64

STATE = np.dtype(
    [
        ("cycle", "i8"),
        ("y", "f8", (STATES,)),
        ("work", "f8", (3, STATES)),
        ("slip_m", "f8", (2, ELEMENTS)),
        ("pull_n", "f8", (2,)),
        ("length_m", "f8", (2,)),
        (
            "line",
            "f8",
            (8,),
        ),  # enabled, mode, target start, end, slope start, end, speed start, end
        ("torque_nm", "f8"),
        ("valves", "f8", (RING, 4)),
        ("seen", "f8", (4,)),
        ("encoder", "f8", (RING, 2)),
        ("held", "f8", (2,)),
        ("stick_pa", "f8", (2,)),
        ("play_m", "f8", (3,)),
    ],
    align=True,
)


def with_hidden(params: np.ndarray, **hidden: float) -> np.ndarray:
    """Stand-in parameters, (1,) STAND_IN: a copy of nominal ones, (1,) PARAMS, and these hidden
    fields.
    """
    out = np.zeros(1, STAND_IN)
    for name in params.dtype.names:
        out[name] = params[name]
    for name, value in HIDDEN_FIELDS:
        out["hidden"][name] = value
    for name, value in hidden.items():
        out["hidden"][name] = value
    return out
