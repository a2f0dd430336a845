"""Effects of the catalogue in the gas and in the muscle."""

from epa_rt.models.effect import Effect

FACTS = "engineering estimate"
LITERATURE = "ISO 6358 / ISO 8778"
GAS, MUSCLE = "Gas", "Muscle"
HEAT, LEAK = "gas heat", "leak"
PRE_SLIDING = "braid friction, pre-sliding"

GAS_EFFECTS: tuple[Effect, ...] = (
    Effect("leak", LEAK, "gas", ("gas.leak_per_s",), ((2.5e-4,),), "gas leaks to the atmosphere", GAS, FACTS),
    Effect("valve_seat_leak", LEAK, "gas", ("gas.inlet_seat_leak_ratio", "gas.exhaust_seat_leak_ratio"),
           ((0.0, 1e-3), (1e-3, 0.0), (1e-3, 1e-3)), "shut valves let gas through", GAS, FACTS),
    Effect("fill_heat", HEAT, "gas", ("gas.fill_heating_ratio", "gas.heat_exchange_per_s"), ((1.2, 0.2), (1.2, 1.0), (1.2, 0.05)),
           "filling warms the gas, which then cools", GAS, FACTS),
    Effect("supply_droop", "supply pressure", "gas", ("gas.supply_droop_pa_s_kg", "gas.droop_time_s"),
           ((1.5e8, 0.02), (1.5e8, 0.2)), "the supply gives way under flow", GAS, FACTS),
)

MUSCLE_EFFECTS: tuple[Effect, ...] = (
    Effect("braid_maxwell_slip", PRE_SLIDING, "muscle",
           ("muscle.slip_ratio", "muscle.slip1_m", "muscle.slip2_m", "muscle.slip3_m"),
           ((0.05, 3e-4, 1e-3, 2.5e-3), (0.05, 1e-3, 3e-3, 5e-3), (0.05, 1e-4, 3e-4, 8e-4)),
           "braid threads stick and slip one after the other", MUSCLE, FACTS),
    Effect("braid_dahl", PRE_SLIDING, "muscle", ("muscle.dahl_ratio", "muscle.dahl_m"),
           ((0.05, 1e-3), (0.05, 3e-4), (0.05, 3e-3)), "braid friction that turns over smoothly at reversals", MUSCLE, FACTS),
    Effect("braid_stribeck", "braid friction, low speed", "muscle", ("muscle.stribeck_ratio", "muscle.stribeck_speed_m_s"),
           ((0.02, 5e-3), (0.02, 2e-3), (0.02, 1.5e-2)), "braid friction that peaks at a low speed", MUSCLE, FACTS),
    Effect("bladder_spring", "bladder spring", "muscle", ("muscle.bladder_stiffness_n_m",), ((300.0,),),
           "the bladder pulls like a spring", MUSCLE, FACTS),
    Effect("threshold_pressure", "threshold pressure", "muscle", ("muscle.threshold_pa",), ((40e3,), (10e3,)),
           "the bladder takes part of the pressure", MUSCLE, FACTS),
    Effect("end_fittings", "muscle length", "muscle", ("muscle.end_length_m",), ((1e-3,), (-1e-3,)),
           "the braid is longer or shorter than between its fittings", MUSCLE, FACTS),
    Effect("braid_lock", "braid lock", "muscle",
           ("muscle.lock_stiffness_n_m", "muscle.lock_viscous_n_s_m", "muscle.lock_length_m"),
           ((6e4, 50.0, 0.15), (6e4, 50.0, 0.145), (6e4, 50.0, 0.14), (6e4, 50.0, 0.13)),
           "the stretched braid locks", MUSCLE, FACTS),
    Effect("strap_compliance", "strap", "muscle", ("muscle.strap_compliance_m_n",), ((1e-5,),),
           "the strap stretches under force", MUSCLE, FACTS),
    Effect("creep", "creep", "muscle", ("muscle.creep_stiffness_n_m", "muscle.creep_time_s"),
           ((300.0, 10.0), (300.0, 1.0), (300.0, 0.2), (300.0, 60.0)), "force relaxes after a stretch", MUSCLE, FACTS),
)
