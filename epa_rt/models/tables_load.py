"""Parameter tables of the load with its wiring, and of the sensors."""

from math import pi

from epa_rt.models.tables import Parameter as P
from epa_rt.models.tables import Table

PAPER = "paper"
FACTS = "engineering estimate"

LOAD: Table = (
    P("kind_code", "1", 0.0, 0.0, 2.0, "0 fixed to the load cell, 1 mass on a line, 2 knee", "rig"),
    P("start_travel_m", "m", 0.0, -1.0, 1.0, "spool travel in the rest state", "rig"),
    P("rest0_m", "m", 0.12, 0.0, 5.0, "muscle 0 at travel 0 and load 0", "rig"),
    P("rest1_m", "m", 0.12, 0.0, 5.0, "muscle 1 at travel 0 and load 0", "rig"),
    P("travel0_ratio", "1", 1.0, -10.0, 10.0, "a of muscle 0: lengthening per spool travel", "rig"),
    P("travel1_ratio", "1", 0.0, -10.0, 10.0, "a of muscle 1", "rig"),
    P("load0_ratio", "1", 0.0, -10.0, 10.0, "b of muscle 0: lengthening per load coordinate", "rig"),
    P("load1_ratio", "1", 0.0, -10.0, 10.0, "b of muscle 1", "rig"),
    P("mass_kg", "kg", 0.759, 1e-3, 1e3, "moved mass; for the knee the shank's", "rig"),
    P("bias_n", "N", 0.0, -1e4, 1e4, "constant force along the load coordinate (kind 1)", "rig"),
    P("viscous_n_s_m", "N*s/m", 0.0, 0.0, 1e4, "viscous drag of the mass (kind 1)", "rig"),
    P("coulomb_n", "N", 0.0, 0.0, 1e3, "dry friction of the mass (kind 1)", FACTS, "guide_friction"),
    P("guide_stiffness_n_m", "N/m", 2e4, 1.0, 1e7, "spring of the sticking mass", FACTS),
    P("low_m", "m", -0.5, -10.0, 10.0, "lower end stop of the mass", "rig"),
    P("high_m", "m", 0.5, -10.0, 10.0, "upper end stop of the mass", "rig"),
    P("inertia_kg_m2", "kg*m^2", 0.067, 1e-5, 100.0, "shank about the knee", "rig"),
    P("lever_m", "m", 0.057, 1e-3, 1.0, "moment arm r of both muscles", "rig"),
    P("mass_lever_m", "m", 0.186, 0.0, 5.0, "knee to the shank's centre of mass", "rig"),
    P("hang_rad", "rad", pi / 4, -pi, pi, "angle from vertical at joint angle 0", "rig"),
    P("gravity_m_s2", "m/s^2", 9.81, 0.0, 20.0, "gravity (kind 2)", "standard"),
    P("viscous_nm_s_rad", "N*m*s/rad", 0.08, 0.0, 100.0, "viscous drag of the knee", "rig"),
    P("low_rad", "rad", -0.2618, -pi, pi, "lower end stop of the knee", "rig"),
    P("high_rad", "rad", 0.6, -pi, pi, "upper end stop of the knee", "rig"),
    P("stop_stiffness_nm_rad", "N*m/rad", 500.0, 1.0, 1e5, "end stop (knee); per metre for a mass", FACTS),
    P("stop_viscous_nm_s_rad", "N*m*s/rad", 5.0, 0.0, 1e3, "end stop damping", FACTS),
    P("presliding_time_s", "s", 2e-3, 5e-4, 0.1, "damper over spring of the sticking load", FACTS),
    P("knee_coulomb_nm", "N*m", 0.0, 0.0, 10.0, "dry friction of the knee", FACTS, "knee_friction"),
    P("knee_friction_speed_rad_s", "rad/s", 0.0, 0.0, 0.5, "speed at which half of the knee's dry friction is there; 0: all of it at once",
      "regularised Coulomb friction, e.g. Armstrong-Helouvry 1994; " + FACTS, "knee_friction"),
    P("knee_stiffness_nm_rad", "N*m/rad", 50.0, 0.1, 1e5, "spring of the sticking knee", FACTS),
    P("knee_bend_ratio", "1", 0.0, 0.0, 1.0, "0: the sticking knee bends evenly until it slides; 1: less the nearer it is to sliding, as bristles do", "P. R. Dahl, A solid friction model, 1968"),
    P("payload_kg", "kg", 0.0, -10.0, 10.0, "mass added to the shank, or to the mass", FACTS, "payload"),
    P("payload_lever_ratio", "1", 1.0, 0.25, 3.0, "where it hangs on the shank, over the lever of the shank's centre", FACTS),
    P("misalignment_rad", "rad", 0.0, -0.2, 0.2, "error of the hanging angle", FACTS, "gravity_misalignment"),
    P("knee_spring_nm_rad", "N*m/rad", 0.0, 0.0, 100.0, "spring of the knee about joint angle 0", FACTS, "knee_spring"),
    P("lever_slope_per_rad", "1/rad", 0.0, -1.0, 1.0, "relative change of the moment arm over angle, at angle zero", FACTS, "moment_arm"),
    P("lever_curve_per_rad2", "1/rad^2", 0.0, -2.5, 2.5, "relative change of that slope over angle, at angle zero", "a pulley off its axis; engineering estimate", "moment_arm"),
)

CHANNELS: tuple[tuple[str, str], ...] = (
    ("motor_angle_rad", "rad"), ("motor_speed_rad_s", "rad/s"), ("motor_current_a", "A"), ("motor_torque_nm", "N*m"),
    ("muscle0_gauge_pa", "Pa"), ("muscle1_gauge_pa", "Pa"), ("supply_gauge_pa", "Pa"), ("force_n", "N"),
    ("joint_angle_rad", "rad"), ("joint_speed_rad_s", "rad/s"), ("load_position_m", "m"),
)


def split(channel: str) -> tuple[str, str]:
    """('force_n') as ('force', '_n')."""
    for suffix in ("_rad_s", "_rad", "_pa", "_nm", "_n", "_a", "_m"):
        if channel.endswith(suffix):
            return channel[: -len(suffix)], suffix
    raise ValueError(channel)


def _channel_rows() -> Table:
    rows: list[P] = []
    for channel, unit in CHANNELS:
        stem, suffix = split(channel)
        rows += [
            P(f"{stem}_gain_ratio", "1", 1.0, 0.5, 2.0, f"reading of {stem} over its truth", FACTS, f"{stem}_gain")
            if channel != "motor_torque_nm" else
            P("motor_torque_gain_ratio", "1", 1.0, 0.5, 2.0, "torque constant that the drive was set up with over the motor's", "rig"),
            P(f"{stem}_offset{suffix}", unit, 0.0, -1e6, 1e6, f"added to {stem}", FACTS, f"{stem}_offset"),
            P(f"{stem}_noise{suffix}", unit, 0.0, 0.0, 1e6, f"standard deviation of {stem} per cycle", FACTS),
        ]
    return tuple(rows)


def _instrument_rows() -> Table:
    """What an instrument does beside gain, offset and noise."""
    return (
        P("gauge_skew_s", "s", 0.0, 0.0, 0.06, "age of the pressures that are read", FACTS, "gauge_skew"),
        P("gauge_lag_s", "s", 0.0, 0.0, 1.0, "first-order lag of a tube or filter behind the pressure sensors of the muscles", FACTS, "gauge_lag"),
        P("force_skew_s", "s", 0.0, 0.0, 0.06, "age of the force that is read", FACTS, "force_skew"),
        P("encoder_skew_s", "s", 0.0, 0.0, 0.06, "age of the motor angle and speed that are read", FACTS, "encoder_skew"),
        P("joint_skew_s", "s", 0.0, 0.0, 0.06, "age of the joint angle and speed that are read", FACTS, "joint_skew"),
        P("force_lag_s", "s", 0.0, 0.0, 1.0, "first-order lag of the load cell", FACTS, "force_lag"),
        P("frame_mode_ratio", "1", 0.0, 0.0, 1.0, "part of the force that reaches the cell through the frame", FACTS, "frame_mode"),
        P("frame_hz", "Hz", 20.0, 1.0, 200.0, "frequency of the frame without damping", FACTS),
        P("frame_damping_ratio", "1", 0.05, 1e-3, 0.15, "damping of the frame over the critical one", FACTS),
        P("muscle0_gauge_drift_pa", "Pa", 0.0, -1e5, 1e5, "added to muscle0_gauge once warm", FACTS, "muscle0_gauge_drift"),
        P("muscle1_gauge_drift_pa", "Pa", 0.0, -1e5, 1e5, "added to muscle1_gauge once warm", FACTS, "muscle1_gauge_drift"),
        P("gauge_warm_up_s", "s", 300.0, 1.0, 1e5, "time constant of the pressure sensors' warming", FACTS),
        P("force_drift_n", "N", 0.0, -100.0, 100.0, "added to force once warm", FACTS, "force_drift"),
        P("force_warm_up_s", "s", 300.0, 1.0, 1e5, "time constant of the load cell's warming", FACTS),
        P("force_crosstalk_n_pa", "N/Pa", 0.0, -1e-3, 1e-3, "force read per gauge pressure of muscle 0", FACTS, "force_crosstalk"),
        P("gauge_crosstalk_pa_n", "Pa/N", 0.0, -1e3, 1e3, "pressure of muscle 0 read per force", FACTS, "gauge_crosstalk"),
        P("force_bow_per_n", "1/N", 0.0, -1e-3, 1e-3, "relative change of the force reading per force", FACTS, "force_bow"),
        P("muscle0_gauge_bow_per_pa", "1/Pa", 0.0, -2e-7, 2e-7, "the same for muscle0_gauge, per pressure", FACTS,
          "muscle0_gauge_bow"),
        P("muscle1_gauge_bow_per_pa", "1/Pa", 0.0, -2e-7, 2e-7, "the same for muscle1_gauge, per pressure", FACTS,
          "muscle1_gauge_bow"),
    )


SENSORS_TABLE: Table = (
    P("seed", "1", 1.0, 0.0, 2.0**53 - 1, "seed of the noise, an integer", "chosen"),
    P("pressure_lag_s", "s", 2.5e-3, 0.0, 1.0, "first-order lag of the pressure sensors", "SMC PSE530 response time"),
    P("encoder_hold_s", "s", 0.0, 0.0, 0.1, "period in which the encoder reading renews; 0 is every cycle", PAPER),
    P("encoder_eccentricity_rad", "rad", 0.0, 0.0, 0.1, "once-per-turn error of the motor encoder", FACTS, "encoder_eccentricity"),
    P("encoder_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "motor angle at which that error is zero, negative", FACTS),
    P("encoder_twice_sine_ratio", "1", 0.0, -0.5, 0.5, "twice-per-turn part of that error, in phase", "a disc that is tilted, too; engineering estimate"),
    P("encoder_twice_cosine_ratio", "1", 0.0, -0.5, 0.5, "the same, a quarter of its period ahead", "engineering estimate"),
    *_instrument_rows(),
    *_channel_rows(),
)
