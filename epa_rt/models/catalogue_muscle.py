"""Effects of the catalogue in the gas and in the muscle."""

from epa_rt.models.effect import Effect

FACTS = "engineering estimate"
LAWS = "engineering estimate; laws as published"
GAS, MUSCLE = "Gas", "Muscle"
HEAT, LEAK = "gas heat", "leak"
NARROW = "gas.leak_laminar_ratio"
PRE_SLIDING = "braid friction, pre-sliding"
SPRING = "spring beside the muscle"  # a lock that begins where the muscle does is a bladder

GAS_EFFECTS: tuple[Effect, ...] = (
    Effect("leak", LEAK, "gas", ("gas.leak_per_s", NARROW), ((2.5e-4, 0.0), (1e-4, 1.0)), "gas leaks to the atmosphere", GAS, FACTS),
    Effect("valve_seat_leak", LEAK, "gas", ("gas.inlet_seat_leak_ratio", "gas.exhaust_seat_leak_ratio", NARROW),
           ((1e-3, 1e-3, 0.0), (0.0, 1e-3, 0.0), (1e-3, 0.0, 1.0), (1e-3, 0.0, 0.0)), "shut valves let gas through", GAS, FACTS),
    Effect("fill_heat", HEAT, "gas", ("gas.fill_heating_ratio", "gas.heat_exchange_per_s"), ((1.2, 0.2), (1.2, 1.0), (1.2, 0.05)),
           "filling warms the gas, which then cools", GAS, FACTS),
    Effect("polytropic", HEAT, "gas", ("gas.polytropic_ratio",), ((1.2,), (1.35,)),
           "compression warms the gas, which does not cool", GAS, FACTS),
    Effect("compression_heat", HEAT, "gas", ("gas.compression_heating_ratio", "gas.compression_cooling_per_s"),
           ((0.3, 2.0), (0.3, 0.3), (0.3, 20.0)), "compression warms the gas, which then cools", GAS, FACTS),
    Effect("gas_energy", HEAT, "gas", ("gas.adiabatic_ratio", "gas.wall_exchange_per_s", "gas.wall_exchange_fall_ratio", "gas.wall_exchange_rise_ratio",
                                       "gas.wall_exchange_stir_s"),
           ((1.0, 2.0, 0.5, 0.1, 0.0), (1.0, 0.3, 0.5, 0.1, 0.0), (1.0, 2.0, 0.5, 0.1, 2.0), (1.0, 6.0, 1.0, 0.1, 0.0)),
           "filling and compressing warm the gas, venting cools it, the walls bring it back", GAS, "first law of thermodynamics"),
    Effect("valve_flow_limit", "valve flow", "gas", ("gas.flow_limit_s_kg",), ((1000.0,),),
           "valves pass less the more flows", GAS, FACTS),
    Effect("valve_stuck", "valve flow", "gas", ("gas.inlet_stuck_ratio", "gas.exhaust_stuck_ratio"),
           ((0.3, 0.0), (0.0, 0.3), (0.3, 0.3)), "a valve opens only part of its way", GAS, FACTS),
    Effect("supply_droop", "supply pressure", "gas", ("gas.supply_droop_pa_s_kg", "gas.droop_time_s", "gas.droop_ring_ratio", "gas.droop_bend_s_kg"),
           ((1.5e8, 0.02, 0.5, 0.0), (1.5e8, 0.2, 0.5, 0.0), (1.5e8, 0.05, 0.5, 3e3)), "the supply gives way under flow, and may swing or choke", GAS, FACTS),
)

MUSCLE_EFFECTS: tuple[Effect, ...] = (
    Effect("braid_maxwell_slip", PRE_SLIDING, "muscle",
           ("muscle.slip_ratio", "muscle.slip1_m", "muscle.slip2_m", "muscle.slip3_m"),
           ((0.05, 3e-4, 1e-3, 2.5e-3), (0.05, 1e-3, 3e-3, 5e-3), (0.05, 1e-4, 3e-4, 8e-4)),
           "braid threads stick and slip one after the other", MUSCLE, FACTS),
    Effect("braid_dahl", PRE_SLIDING, "muscle", ("muscle.dahl_ratio", "muscle.dahl_m"),
           ((0.05, 1e-3), (0.05, 3e-4), (0.05, 3e-3)), "braid friction that turns over smoothly at reversals", MUSCLE, FACTS),
    Effect("braid_lugre", PRE_SLIDING, "muscle",
           ("muscle.lugre_ratio", "muscle.lugre_m", "muscle.lugre_extra_ratio", "muscle.lugre_speed_m_s"),
           ((0.05, 1e-3, 0.3, 5e-3), (0.05, 3e-4, 0.3, 5e-3), (0.05, 3e-3, 0.3, 5e-3)),
           "bristles of the braid bend before they slip, and hold more near standstill", MUSCLE, LAWS),
    Effect("braid_bouc_wen", PRE_SLIDING, "muscle",
           ("muscle.bouc_wen_ratio", "muscle.bouc_wen_m", "muscle.bouc_wen_exponent_ratio"),
           ((0.05, 1e-3, 2.0), (0.05, 3e-4, 2.0), (0.05, 3e-3, 2.0)), "braid friction with a rounded knee", MUSCLE, LAWS),
    Effect("braid_preisach", PRE_SLIDING, "muscle",
           ("muscle.preisach_ratio", "muscle.preisach_m", "muscle.preisach_slope_per_m"),
           ((0.05, 4e-3, 20.0), (0.05, 1e-3, 20.0), (0.05, 4e-3, -20.0)),
           "braid friction with memory whose strength depends on the place", MUSCLE, LAWS),
    Effect("braid_run_in", PRE_SLIDING, "muscle", ("muscle.run_in_ratio", "muscle.run_in_m"),
           ((0.02, 2.0), (0.02, 0.5), (0.02, 10.0)), "braid friction that wears off with the way travelled", MUSCLE, FACTS),
    Effect("braid_coulomb", PRE_SLIDING, "muscle", ("muscle.coulomb_ratio", "muscle.coulomb_speed_m_s"),
           ((0.05, 2e-3), (0.05, 5e-4)), "dry friction of the braid without memory", MUSCLE, FACTS),
    Effect("braid_pressure_viscous", "muscle drag", "muscle", ("muscle.pressure_viscous_s_m",), ((0.05,),),
           "drag of the braid grows with pressure", MUSCLE, "paper eq. 6"),
    Effect("braid_stribeck", "braid friction, low speed", "muscle",
           ("muscle.stribeck_ratio", "muscle.stribeck_speed_m_s", "muscle.stribeck_tail_ratio", "muscle.stribeck_breadth_ratio"),
           ((0.02, 5e-3, 0.5, 1.0), (0.02, 2e-3, 0.5, 1.0), (0.02, 1.5e-2, 0.5, 1.0)), "braid friction that peaks at a low speed", MUSCLE, FACTS),
    Effect("bladder_spring", SPRING, "muscle", ("muscle.bladder_stiffness_n_m", "muscle.bladder_hardening_per_m"),
           ((300.0, 30.0), (300.0, 0.0)),
           "the bladder pulls like a spring", MUSCLE, FACTS),
    Effect("threshold_pressure", "threshold pressure", "muscle", ("muscle.threshold_pa",), ((40e3,), (10e3,)),
           "the bladder takes part of the pressure", MUSCLE, FACTS),
    Effect("pull_softening", "pull over pressure", "muscle", ("muscle.softening_per_pa",), ((1.5e-7,), (5e-8,)),
           "the braid gives under pressure, and the muscle pulls less per pressure", MUSCLE, "Chambers and Wereley 2022; form estimated"),
    Effect("end_fittings", "muscle length", "muscle", ("muscle.end_length_m",), ((1e-3,), (-1e-3,)),
           "the braid is longer or shorter than between its fittings", MUSCLE, FACTS),
    Effect("braid_lock", SPRING, "muscle",
           ("muscle.lock_stiffness_n_m", "muscle.lock_viscous_n_s_m", "muscle.lock_length_m", "muscle.lock_hardening_per_m", "muscle.lock_steepening_ratio"),
           ((1e4, 50.0, 0.145, 50.0, 1.0), (6e4, 50.0, 0.15, 0.0, 1.0), (1e4, 50.0, 0.14, 50.0, 1.0), (1e4, 50.0, 0.13, 50.0, 1.0), (1e3, 50.0, 0.14, 100.0, 4.0)),
           "the stretched braid locks", MUSCLE, FACTS),
    Effect("strap_compliance", "strap", "muscle", ("muscle.strap_compliance_m_n", "muscle.strap_stiffening_per_n"), ((1e-5, 5e-3), (1e-5, 0.0)),
           "the strap stretches under force", MUSCLE, FACTS),
    Effect("creep", "creep", "muscle", ("muscle.creep_stiffness_n_m", "muscle.creep_time_s", "muscle.creep_slow_ratio"),
           ((300.0, 10.0, 0.5), (300.0, 1.0, 0.5), (300.0, 0.2, 0.5), (1000.0, 0.01, 0.5), (300.0, 60.0, 0.0)), "force relaxes after a stretch", MUSCLE, FACTS),
)
