"""The ports of the simulated plant that a row of the rig file may name, and the direction of
each.
"""

MEASURED_PORTS = (
    "motor_angle_rad",
    "motor_speed_rad_s",
    "motor_current_a",
    "motor_torque_nm",
    "muscle0_gauge_pa",
    "muscle1_gauge_pa",
    "supply_gauge_pa",
    "force_n",
    "joint_angle_rad",
    "joint_speed_rad_s",
    "load_position_m",
)
VALVE_PORTS = {
    "muscle0_inlet": (0, False),
    "muscle0_exhaust": (0, True),
    "muscle1_inlet": (1, False),
    "muscle1_exhaust": (1, True),
}
DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT = "drive_enable", "drive_analog_speed"
