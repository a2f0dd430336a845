"""Parameter tables of the blocks between the bus and the spool: bus timing, drive, transmission."""

from math import pi

from epa_rt.models.tables import Parameter as P
from epa_rt.models.tables import Table

MAXON = "maxon EC-max 40 120 W 48 V (283870)"
FACTS = "engineering estimate"
REGULAR = "regularised Coulomb friction, Armstrong-Helouvry 1994; engineering estimate"
TWO_NODES = "motor data sheets give two thermal resistances and time constants; engineering estimate"
HARMONIC = "poles and slots are no sines; engineering estimate"
STRIBECK = "Armstrong-Helouvry, Dupont and Canudas de Wit 1994 (2 of a Gaussian, 0.5 to 1 of Bo and Pavelescu)"
EPOS = "EPOS4 cascade, tuned here"

BUS: Table = (
    P("command_delay_s", "s", 0.0, 0.0, 0.06, "age of the motor command when the drive uses it", FACTS, "transport_delay"),
    P("valve_delay_s", "s", 0.0, 0.0, 0.06, "age of the valve command when the valves see it, the later of opening and closing", FACTS, "valve_dead_time"),
    P("valve_skew_ratio", "1", 0.0, -0.7, 0.7, "part of that by which closing comes earlier than opening (negative: opening earlier)",
      "valve data sheets give times for on and off that differ; engineering estimate", "valve_dead_time"),
)

DRIVE: Table = (
    P("supply_v", "V", 48.0, 1.0, 100.0, "bus voltage of the drive", MAXON),
    P("winding_ohm", "ohm", 1.03, 0.01, 100.0, "terminal resistance", MAXON),
    P("torque_constant_nm_a", "N*m/A", 0.0448, 1e-4, 10.0, "torque per current, and voltage per speed", MAXON),
    P("inertia_kg_m2", "kg*m^2", 1.1e-5, 1e-8, 1.0, "rotor and gear input side", MAXON + ", gear estimated"),
    P("max_current_a", "A", 8.0, 0.01, 200.0, "limit of the current command", FACTS),
    P("max_speed_rad_s", "rad/s", 968.7, 0.1, 1e4, "limit of the speed command (9250 rpm)", MAXON),
    P("current_lag_s", "s", 5e-4, 2e-4, 0.02, "first-order lag of the current loop", FACTS),
    P("position_gain_per_s", "1/s", 100.0, 0.0, 1e4, "speed command per position error", EPOS),
    P("feedforward_ratio", "1", 1.0, 0.0, 2.0, "part of the target's own slope added to the speed command", EPOS),
    P("speed_gain_a_s_rad", "A*s/rad", 0.12, 0.0, 100.0, "current command per speed error", EPOS),
    P("speed_integral_a_rad", "A/rad", 6.0, 0.0, 1e5, "current command per integrated speed error", EPOS),
    P("viscous_nm_s_rad", "N*m*s/rad", 3e-6, 0.0, 1.0, "viscous drag at the motor shaft", MAXON + ", no-load current"),
    P("coulomb_nm", "N*m", 3e-3, 0.0, 10.0, "dry friction at the motor shaft", MAXON + ", no-load current"),
    P("presliding_stiffness_nm_rad", "N*m/rad", 0.4, 1e-3, 1e4, "spring of the sticking motor shaft", FACTS),
    P("presliding_time_s", "s", 2e-3, 5e-4, 0.1, "damper over spring of the sticking motor shaft", FACTS),
    P("stribeck_ratio", "1", 0.0, 0.0, 3.0, "extra break-away over dry friction", FACTS, "motor_stribeck"),
    P("stribeck_speed_rad_s", "rad/s", 20.0, 0.1, 200.0, "speed at which the extra has fallen to 1/e", FACTS),
    P("stribeck_exponent_ratio", "1", 2.0, 0.5, 2.0, "how it falls there: 2 as a Gaussian, less with a sharper peak and a longer tail", STRIBECK),
    P("cogging_nm", "N*m", 0.0, 0.0, 1.0, "amplitude of the cogging torque", FACTS, "cogging"),
    P("cogging_per_turn_ratio", "1", 4.0, 1.0, 200.0, "cogging periods per motor turn", FACTS),
    P("cogging_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "phase of the cogging at motor angle 0", FACTS),
    P("cogging_twice_sine_ratio", "1", 0.0, -0.5, 0.5, "second harmonic of the cogging, in phase, over its amplitude", HARMONIC),
    P("cogging_twice_cosine_ratio", "1", 0.0, -0.5, 0.5, "the same, a quarter of its period ahead", HARMONIC),
    P("torque_ripple_ratio", "1", 0.0, 0.0, 0.5, "relative ripple of the torque constant", FACTS, "torque_ripple"),
    P("ripple_per_turn_ratio", "1", 6.0, 1.0, 200.0, "ripple periods per motor turn", FACTS),
    P("ripple_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "phase of the ripple at motor angle 0", FACTS),
    P("ripple_twice_sine_ratio", "1", 0.0, -0.5, 0.5, "second harmonic of the ripple, in phase, over its amplitude", HARMONIC),
    P("ripple_twice_cosine_ratio", "1", 0.0, -0.5, 0.5, "the same, a quarter of its period ahead", HARMONIC),
    P("torque_saturation_per_a", "1/A", 0.0, 0.0, 0.1, "torque lost per current: kt i/(1 + s |i|)", FACTS, "torque_saturation"),
    P("viscous_asymmetry_ratio", "1", 0.0, -0.95, 0.95, "drag forwards over its mean, less 1", FACTS, "motor_viscous_asymmetry"),
    P("friction_wave_ratio", "1", 0.0, 0.0, 1.0, "dry friction's swing over the shaft's angle", FACTS, "motor_friction_wave"),
    P("friction_wave_per_turn_ratio", "1", 1.0, 0.01, 200.0, "periods of that swing per motor turn", FACTS),
    P("friction_wave_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "phase of that swing at motor angle 0", FACTS),
    P("bus_sag_ohm", "ohm", 0.0, 0.0, 5.0, "voltage lost per winding current", FACTS, "bus_sag"),
    P("torque_loss_per_k", "1/K", 0.0, 0.0, 0.01, "torque constant lost per kelvin of winding heat, down to a tenth of it", FACTS, "torque_constant_heat"),
    P("winding_thermal_k_w", "K/W", 1.0, 1e-3, 100.0, "winding to housing", FACTS),
    P("winding_time_s", "s", 3.96, 0.1, 1e4, "thermal time constant of the winding", MAXON),
    P("housing_heat_ratio", "1", 0.0, 0.0, 20.0, "kelvins of housing and magnets that count, per kelvin of winding heat, once both are steady", TWO_NODES),
    P("housing_time_s", "s", 60.0, 5.0, 3000.0, "thermal time constant of housing and magnets", TWO_NODES),
)


OFF_CENTRE = "a pinion off its centre; engineering estimate"
TRANSMISSION: Table = (
    P("gear_ratio", "1", 19.0, 1.0, 1e3, "motor turns per spool turn", "planetary gear, chosen"),
    P("spool_radius_m", "m", 0.010, 1e-3, 0.5, "radius at which the strap leaves the spool", "chosen"),
    P("gear_efficiency_ratio", "1", 1.0, 0.2, 1.0, "output over input power, either way", FACTS, "gear_efficiency"),
    P("gear_friction_n", "N", 0.0, 0.0, 500.0, "dry friction of the gear, as force at the spool", FACTS, "gear_friction"),
    P("gear_friction_speed_rad_s", "rad/s", 0.0, 0.0, 50.0, "motor speed at which the gear's friction is built up (half of it at sharpness 1); at 0 it is there at once",
      REGULAR),
    P("gear_friction_sharpness_ratio", "1", 1.0, 1.0, 8.0, "how sharply the gear's friction ends its rise there", REGULAR),
    P("gear_sliding_ratio", "1", 0.0, 0.0, 1.0, "part of the gear's friction that is a function of the speed alone and holds nothing at rest", REGULAR),
    P("backlash_rad", "rad", 0.0, 0.0, 0.4, "total play at the gear's output", FACTS, "backlash"),
    P("backlash_roundness_ratio", "1", 0.0, 0.0, 1.0, "how gradually the teeth take up the play: 0 at once, 1 over a way of several halves of it",
      "several pairs of teeth in elastic contact; engineering estimate"),
    P("uneven_backlash_rad", "rad", 0.0, 0.0, 0.4, "a play at the gear's output that is wider in some places of the spool's turn, half way between its widest and its narrowest", OFF_CENTRE, "uneven_backlash"),
    P("backlash_wave_ratio", "1", 0.5, 0.0, 0.95, "how much wider it is there, over that", OFF_CENTRE),
    P("backlash_per_turn_ratio", "1", 1.0, 0.5, 8.0, "in how many places of a turn it is: 1 of a pinion off its centre, more of teeth that have worn", OFF_CENTRE),
    P("backlash_narrowness_ratio", "1", 1.0, 0.5, 16.0, "how narrow these places are: 1 a sine, more where a few teeth have worn", OFF_CENTRE),
    P("backlash_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "phase of that at spool travel 0", OFF_CENTRE),
    P("eccentricity_ratio", "1", 0.0, 0.0, 0.3, "eccentricity over radius of the spool", FACTS, "spool_eccentricity"),
    P("eccentricity_phase_rad", "rad", 0.0, -2 * pi, 2 * pi, "spool angle where the radius has its mean and grows, negative", FACTS),
    P("wind_up_per_rad", "1/rad", 0.0, -0.1, 0.1, "radius gained per spool angle as the strap winds up", FACTS, "spool_wind_up"),
)
