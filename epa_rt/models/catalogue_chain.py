"""Effects of the catalogue between the bus and the spool, and of the load."""

from epa_rt.models.effect import Effect

FACTS = "engineering estimate"
BUS, DRIVE, GEAR, LOAD = "Bus timing", "Drive", "Transmission", "Wiring and load"
DRY = "motor and gear friction"
MOTOR_ANGLE = "motor_angle_rad"
RISE = tuple(f"transmission.gear_{name}" for name in ("friction_speed_rad_s", "friction_sharpness_ratio", "sliding_ratio"))   # over speed
THIRDS = (0.0, 2.1, -2.1)  # rad: from one of these phases a fit reaches every phase

CHAIN: tuple[Effect, ...] = (
    Effect("transport_delay", "motor command timing", "bus", ("bus.command_delay_s",), ((3e-3,), (1e-3,)),
           "motor commands arrive late", BUS, FACTS),
    Effect("valve_dead_time", "valve command timing", "bus", ("bus.valve_delay_s", "bus.valve_skew_ratio"), ((15e-3, 0.1), (5e-3, 0.0), (15e-3, -0.1)),
           "valves act late on their commands, and not equally late when they open and close", BUS, FACTS),
    Effect("motor_stribeck", DRY, "drive", ("drive.stribeck_ratio", "drive.stribeck_speed_rad_s", "drive.stribeck_exponent_ratio"),
           ((0.17, 20.0, 2.0), (0.17, 5.0, 2.0), (0.17, 60.0, 2.0), (0.17, 20.0, 1.0)),
           "dry friction of the motor is larger near standstill", DRIVE, FACTS),
    Effect("motor_viscous_asymmetry", DRY, "drive", ("drive.viscous_asymmetry_ratio",), ((0.5,), (-0.5,)),
           "the motor's drag differs between its directions", DRIVE, FACTS),
    Effect("motor_friction_wave", DRY, "drive",
           ("drive.friction_wave_ratio", "drive.friction_wave_per_turn_ratio", "drive.friction_wave_phase_rad"),
           tuple((0.3, n, phase) for n in (1.0, 1.0 / 19.0) for phase in THIRDS),
           "dry friction varies over the shaft's angle", DRIVE, FACTS, MOTOR_ANGLE),
    Effect("cogging", "motor torque over its angle", "drive",
           ("drive.cogging_nm", "drive.cogging_per_turn_ratio", "drive.cogging_phase_rad", "drive.cogging_twice_sine_ratio", "drive.cogging_twice_cosine_ratio"),
           tuple((4e-3, n, phase, 0.0, 0.0) for n in (4.0, 6.0, 8.0) for phase in THIRDS),
           "the motor's magnets hold it in places", DRIVE, FACTS, MOTOR_ANGLE),
    Effect("torque_ripple", "motor torque over its angle", "drive",
           ("drive.torque_ripple_ratio", "drive.ripple_per_turn_ratio", "drive.ripple_phase_rad", "drive.ripple_twice_sine_ratio", "drive.ripple_twice_cosine_ratio"),
           tuple((0.03, n, phase, 0.0, 0.0) for n in (6.0, 4.0, 12.0) for phase in THIRDS),
           "torque per current varies over a motor turn", DRIVE, FACTS, MOTOR_ANGLE),
    Effect("torque_saturation", "torque constant", "drive", ("drive.torque_saturation_per_a",), ((0.01,),),
           "the motor gives less torque per ampere at high current", DRIVE, FACTS),
    Effect("bus_sag", "supply voltage", "drive", ("drive.bus_sag_ohm",), ((0.3,),),
           "the drive's supply gives way under current", DRIVE, FACTS),
    Effect("torque_constant_heat", "motor heat", "drive", ("drive.torque_loss_per_k", "drive.housing_heat_ratio", "drive.housing_time_s"),
           ((1.5e-3, 0.0, 60.0), (1.5e-3, 2.0, 30.0), (1.5e-3, 2.0, 300.0)),
           "the warm motor gives less torque per current, soon by its winding, later by its housing", DRIVE, FACTS),
    Effect("gear_efficiency", "gear efficiency", "transmission", ("transmission.gear_efficiency_ratio", *RISE), ((0.75, 3.0, 2.0, 1.0), (0.9, 0.0, 1.0, 0.0)),
           "the gear's friction grows with the force that it passes on", GEAR, FACTS),
    Effect("gear_friction", DRY, "transmission", ("transmission.gear_friction_n", *RISE), ((10.0, 3.0, 2.0, 1.0), (10.0, 0.0, 1.0, 0.0)),
           "dry friction of the gear, there at once or building up with speed", GEAR, FACTS),
    Effect("backlash", "gear play", "transmission", ("transmission.backlash_rad", "transmission.backlash_roundness_ratio"),
           ((9.6e-3, 0.0), (2.5e-3, 0.0), (9.6e-3, 0.5)),
           "the gear has play, which its teeth take up at once or gradually", GEAR, FACTS),
    Effect("uneven_backlash", "gear play", "transmission",
           tuple(f"transmission.{name}" for name in ("uneven_backlash_rad", "backlash_wave_ratio", "backlash_per_turn_ratio", "backlash_phase_rad", "backlash_narrowness_ratio")),
           tuple((9.6e-3, 0.5, float(n), phase, 1.0 if n == 1 else 2.0) for n in range(1, 7) for phase in THIRDS),
           "the gear has play that is wider in some places of the spool's turn", GEAR, FACTS),
    Effect("spool_eccentricity", "spool radius", "transmission",
           ("transmission.eccentricity_ratio", "transmission.eccentricity_phase_rad"), tuple((0.03, phase) for phase in THIRDS),
           "the spool does not run in its middle", GEAR, FACTS),
    Effect("spool_wind_up", "spool radius", "transmission", ("transmission.wind_up_per_rad",), ((0.016,), (-0.016,)),
           "the strap winds up on itself", GEAR, FACTS),
    Effect("guide_friction", "load friction", "load", ("load.coulomb_n",), ((3.0,),),
           "dry friction of the mass in its guide", LOAD, FACTS),
    Effect("knee_friction", "load friction", "load", ("load.knee_coulomb_nm", "load.knee_friction_speed_rad_s", "load.knee_stiffness_nm_rad", "load.knee_bend_ratio"),
           ((0.1, 0.0, 50.0, 0.0), (0.1, 0.05, 50.0, 0.0), (0.1, 0.0, 15.0, 0.0), (0.1, 0.0, 30.0, 1.0)), "dry friction of the knee, which bends before it slides", LOAD, FACTS),
    Effect("payload", "load mass", "load", ("load.payload_kg", "load.payload_lever_ratio"), ((0.1, 1.0), (-0.1, 1.0), (0.1, 1.5)),
           "the load weighs more or less, a shank's at a lever of its own", LOAD, FACTS),
    Effect("gravity_misalignment", "gravity", "load", ("load.misalignment_rad",), ((0.026,), (-0.026,)),
           "the rig does not stand upright", LOAD, FACTS),
    Effect("knee_spring", "joint spring", "load", ("load.knee_spring_nm_rad",), ((0.5,),),
           "cables or skin hold the knee like a spring", LOAD, FACTS),
    Effect("moment_arm", "moment arm", "load", ("load.lever_slope_per_rad", "load.lever_curve_per_rad2"), ((0.3, 0.3), (0.3, -0.3), (-0.3, 0.3), (-0.3, -0.3)),
           "the muscles' lever changes over the knee's angle: a pulley off its axis", LOAD, FACTS),
)
