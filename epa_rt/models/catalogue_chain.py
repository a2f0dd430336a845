"""Effects of the catalogue between the bus and the spool, and of the load."""

from epa_rt.models.effect import Effect

FACTS = "engineering estimate"
BUS, DRIVE, GEAR, LOAD = "Bus timing", "Drive", "Transmission", "Wiring and load"
DRY = "motor and gear friction"
THIRDS = (0.0, 2.1, -2.1)  # rad: from one of these phases a fit reaches every phase

CHAIN: tuple[Effect, ...] = (
    Effect("transport_delay", "motor command timing", "bus", ("bus.command_delay_s",), ((3e-3,), (1e-3,)),
           "motor commands arrive late", BUS, FACTS),
    Effect("valve_dead_time", "valve command timing", "bus", ("bus.valve_delay_s",), ((15e-3,), (5e-3,)),
           "valves act late on their commands", BUS, FACTS),
    Effect("motor_stribeck", DRY, "drive", ("drive.stribeck_ratio", "drive.stribeck_speed_rad_s"),
           ((0.17, 20.0), (0.17, 5.0), (0.17, 60.0)),
           "dry friction of the motor is larger near standstill", DRIVE, FACTS),
    Effect("cogging", "motor torque over its angle", "drive", ("drive.cogging_nm", "drive.cogging_per_turn_ratio"),
           tuple((4e-3, n) for n in (4.0, 6.0, 8.0, 12.0)), "the motor's magnets hold it in places", DRIVE, FACTS),
    Effect("torque_ripple", "motor torque over its angle", "drive", ("drive.torque_ripple_ratio", "drive.ripple_per_turn_ratio"),
           tuple((0.03, n) for n in (6.0, 4.0, 12.0)), "torque per current varies over a motor turn", DRIVE, FACTS),
    Effect("bus_sag", "supply voltage", "drive", ("drive.bus_sag_ohm",), ((0.3,),),
           "the drive's supply gives way under current", DRIVE, FACTS),
    Effect("torque_constant_heat", "motor heat", "drive", ("drive.torque_loss_per_k",), ((1.5e-3,),),
           "the warm motor gives less torque per current", DRIVE, FACTS),
    Effect("gear_efficiency", "gear efficiency", "transmission", ("transmission.gear_efficiency_ratio",), ((0.75,), (0.9,)),
           "the gear's friction grows with the force that it passes on", GEAR, FACTS),
    Effect("gear_friction", DRY, "transmission", ("transmission.gear_friction_n",), ((10.0,),),
           "dry friction of the gear", GEAR, FACTS),
    Effect("backlash", "gear play", "transmission", ("transmission.backlash_rad",), ((9.6e-3,), (2.5e-3,)),
           "the gear has play", GEAR, FACTS),
    Effect("spool_eccentricity", "spool radius", "transmission",
           ("transmission.eccentricity_ratio", "transmission.eccentricity_phase_rad"), tuple((0.03, phase) for phase in THIRDS),
           "the spool does not run in its middle", GEAR, FACTS),
    Effect("guide_friction", "load friction", "load", ("load.coulomb_n",), ((3.0,),),
           "dry friction of the mass in its guide", LOAD, FACTS),
    Effect("knee_friction", "load friction", "load", ("load.knee_coulomb_nm",), ((0.1,),),
           "dry friction of the knee", LOAD, FACTS),
    Effect("payload", "load mass", "load", ("load.payload_kg",), ((0.1,), (-0.1,)), "the load weighs more or less", LOAD, FACTS),
    Effect("gravity_misalignment", "gravity", "load", ("load.misalignment_rad",), ((0.026,), (-0.026,)),
           "the rig does not stand upright", LOAD, FACTS),
    Effect("moment_arm", "moment arm", "load", ("load.lever_slope_per_rad",), ((0.3,), (-0.3,)),
           "the muscles' lever changes over the knee's angle", LOAD, FACTS),
)
