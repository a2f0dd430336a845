"""What goes in and out of the plant: the record types of command, sensors, truth and state."""

import numpy as np

from epa_rt.models.tables_load import CHANNELS

COMMAND = np.dtype(
    [
        ("enabled", "f8"),
        ("mode", "f8"),
        ("target_angle_rad", "f8"),
        ("target_speed_rad_s", "f8"),
        ("target_torque_nm", "f8"),
        ("inlet", "f8", (2,)),
        ("exhaust", "f8", (2,)),
    ],
    align=True,
)
SENSORS = np.dtype([(name, "f8") for name, _ in CHANNELS], align=True)
TRUTH = np.dtype(
    [
        ("motor_angle_rad", "f8"),
        ("motor_speed_rad_s", "f8"),
        ("motor_current_a", "f8"),
        ("motor_torque_nm", "f8"),
        ("winding_heat_k", "f8"),
        ("travel_m", "f8"),
        ("travel_speed_m_s", "f8"),
        ("spool_force_n", "f8"),
        ("pressure_pa", "f8", (2,)),
        ("supply_pa", "f8"),
        ("mass_flow_kg_s", "f8", (2,)),
        ("gas_mass_kg", "f8", (2,)),
        ("volume_m3", "f8", (2,)),
        ("muscle_length_m", "f8", (2,)),
        ("muscle_speed_m_s", "f8", (2,)),
        ("muscle_force_n", "f8", (2,)),
        ("load_position_m", "f8"),
        ("load_speed_m_s", "f8"),
        ("joint_angle_rad", "f8"),
        ("joint_speed_rad_s", "f8"),
    ],
    align=True,
)

# The part of the state that the integrator moves: indices into STATE["smooth"].
ANGLE, SPEED, CURRENT, INTEGRAL, STICTION, HEAT = 0, 1, 2, 3, 4, 5
LOAD_PLACE, LOAD_SPEED, LOAD_STICTION, SUPPLY_FLOW = 6, 7, 8, 9
GAS_C, GAS_MASS, CREEP = 10, 12, 14  # two each, one per muscle; of creep two for each branch
BRANCHES = 5  # of creep: a decade of time each
SLOW_HEAT = CREEP + 2 * BRANCHES
SUPPLY_RATE = SLOW_HEAT + 1  # of the lagged supply flow, where the regulator rings
SMOOTH = SUPPLY_RATE + 1
RING = 64  # cycles of command, and of late sensors' truth, that are kept
# The braid's friction elements: indices into STATE["memory"]; slip has four, Preisach three.
SLIP, DAHL, LUGRE, BOUC_WEN, PREISACH, TRAVELLED, MEMORY = 0, 4, 5, 6, 7, 10, 11
# Readings that may come late: columns of STATE["past"].
PAST_GAUGE, PAST_FORCE, PAST_ANGLE, PAST_SPEED, PAST_JOINT, PAST_JOINT_SPEED, PAST = (
    0,
    3,
    4,
    5,
    6,
    7,
    8,
)

STATE = np.dtype(
    [
        ("cycle", "i8"),
        ("smooth", "f8", (SMOOTH,)),
        ("opening", "f8", (2, 2)),  # [muscle, inlet|exhaust], 0 shut to 1 open
        ("memory", "f8", (2, MEMORY)),  # the braid's friction elements, one row per muscle
        (
            "strap_force_n",
            "f8",
            (2,),
        ),  # force of the last sub-step, stretches the strap in the next
        ("length_m", "f8", (2,)),  # muscle lengths at the start of the sub-step
        ("geared_m", "f8"),
        ("travel_m", "f8"),  # spool travel before and after backlash, at the start of the sub-step
        ("ring", "f8", (RING, 13)),  # commands of the last cycles; columns in blocks/bus.py
        ("pressure_reading_pa", "f8", (3,)),
        ("pressure_before_pa", "f8", (3,)),
        (
            "tube_reading_pa",
            "f8",
            (2,),
        ),  # of the muscles, behind a slow tube or filter; kept only where there is one
        ("encoder_angle_rad", "f8"),
        ("encoder_speed_rad_s", "f8"),
        ("force_reading_n", "f8"),
        ("force_before_n", "f8"),
        ("frame_n", "f8"),
        ("frame_n_s", "f8"),
        ("frame_before_n", "f8"),  # force that the swinging frame passes on, its rate
        (
            "past",
            "f8",
            (RING, PAST),
        ),  # truths of the last cycles, kept only for sensors that are late
        ("truth", TRUTH),
    ],
    align=True,
)
