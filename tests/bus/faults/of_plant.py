"""Scenarios: faults of sensors, valves, supply and drive."""

from tests.bus.faults.scenarios import OFF, Scenario, one

_VALID = "loop: validity of the input"
_LOGIC = "valve logic"
_SENSORS = "loop: sensors in motion"
_MOTION = "loop: position against speed"
_FOLLOWING = "loop: following error"
_DRIVE = "loop: status word of the drive"
_NOBODY = "nobody"
_PRESSURE, _INLET, _EXHAUST = (
    "muscle_pressure_pa",
    "cmd_muscle_inlet_open",
    "cmd_muscle_exhaust_open",
)

# where nobody can measure that the muscles are vented, the drive holds for as long
NOT_LONG = {"safety": {"rest_timeout": "3 s"}}
# from 50 mm/s at 2 m/s^2, until the speed loop of the drive has settled as well
BRAKING_CYCLES = 100

SCENARIOS: dict[str, Scenario] = {
    "wire_broken, pressure": Scenario(
        one("wire_broken", _PRESSURE),
        "",
        _VALID,
        23,
        "invalid sensor: muscle_pressure_pa",
        settings=NOT_LONG,
    ),
    "wire_broken, force": Scenario(
        one("wire_broken", "muscle_force_n"), "", _VALID, 3, "invalid sensor: muscle_force_n"
    ),
    "analog: wire_broken, force": Scenario(
        one("wire_broken", "muscle_force_n"),
        "",
        _VALID,
        3,
        "invalid sensor: muscle_force_n",
        rig="bench_analog",
    ),
    "knee: wire_broken, angle": Scenario(
        one("wire_broken", "knee_angle_rad"),
        "",
        _VALID,
        43,
        "invalid sensor: knee_angle_rad",
        rig="knee",
        settings=NOT_LONG,
    ),
    "toggle_frozen": Scenario(
        one("toggle_frozen", "analog_in"),
        "`stale_after: 20` cycles without a new conversion",
        "loop: toggle bit",
        23,
        "stale: muscle_pressure_pa has not been renewed",
        visible=1,
        settings=NOT_LONG,
    ),
    "sensor_noisy, 5 mV": Scenario(
        one("sensor_noisy", _PRESSURE, value=0.005),
        "1.2 kPa of noise: within what the valve logic averages",
        _NOBODY,
        0,
    ),
    "sensor_noisy, 0.5 V": Scenario(
        one("sensor_noisy", _PRESSURE),
        "the first sample out of range",
        _VALID,
        23,
        "muscle_pressure_pa",
        settings=NOT_LONG,
        visible=None,
        gap="that a pressure which the trip calls implausible cannot say `vented`",
    ),
    "sensor_stuck, pressure, filling": Scenario(
        one("sensor_stuck", _PRESSURE),
        "no rise in 0.2 s with the inlet open",
        _SENSORS,
        23,
        "implausible sensor: muscle_pressure_pa stays at",
        when="filling",
        after=10,
        settings=NOT_LONG,
        visible=None,
        gap="that a pressure which the trip calls implausible cannot say `vented`",
    ),
    "sensor_stuck, pressure, venting": Scenario(
        one("sensor_stuck", _PRESSURE),
        "no fall in 0.8 s with the exhaust open",
        _LOGIC,
        23,
        "exhaust stuck closed while venting",
        when="venting",
        after=5,
        visible=None,
        settings=NOT_LONG,
    ),
    "sensor_stuck, force": Scenario(
        one("sensor_stuck", "muscle_force_n"),
        "it stays to the count while the muscle is stretched",
        _SENSORS,
        3,
        "implausible sensor: muscle_force_n stands at",
        seconds=2.0,
        visible=None,
    ),
    "sensor_stuck, travel": Scenario(
        one("sensor_stuck", "motor_travel_m"),
        "position and speed of the drive contradict each other",
        _MOTION,
        3,
        "contradiction: motor_travel_m",
        visible=None,
        stop=OFF,
    ),
    "sensor_stuck, speed": Scenario(
        one("sensor_stuck", "motor_speed_m_s"),
        "position and speed of the drive contradict each other",
        _MOTION,
        43,
        "contradiction: motor_travel_m",
        visible=None,
        stop=OFF,
    ),
    "knee: sensor_stuck, angle": Scenario(
        one("sensor_stuck", "knee_angle_rad"),
        "4 degrees away from its reference for 50 ms",
        _FOLLOWING,
        3,
        "following error: knee_angle_rad",
        rig="knee",
        visible=None,
    ),
    "encoder_jump, 2000 counts": Scenario(
        one("encoder_jump"),
        "1.6 mm in one cycle",
        _MOTION,
        3,
        "position jump: motor_travel_m",
        stop=OFF,
    ),
    "count_offset, moving": Scenario(
        one("count_offset", value=-3000.0),
        "a count that goes wrong in a run is a jump; one that is wrong from the start shows in no"
        " row",
        _MOTION,
        3,
        "position jump: motor_travel_m",
        stop=OFF,
    ),
    "drive_supply_lost": Scenario(
        one("drive_supply_lost"),
        "count and reference are lost with it",
        "driver: working counter, then the states at once",
        74,
        "drive (slave 5, EPOS4) does not answer any more",
        stop=OFF,
    ),
    "valve_stuck_open, inlet, moving": Scenario(
        one("valve_stuck_open", _INLET),
        "a gain that heat cannot explain, or the limit of the pressure",
        _SENSORS,
        23,
        "implausible sensor: muscle_pressure_pa rises to",
        stuck=("inlet",),
        visible=None,
        settings=NOT_LONG,
    ),
    "valve_stuck_open, inlet, filling": Scenario(
        one("valve_stuck_open", _INLET),
        "the pressure goes on rising with both valves closed",
        _LOGIC,
        23,
        "inlet stuck open while settling",
        when="filling",
        after=10,
        stuck=("inlet",),
        visible=None,
        settings=NOT_LONG,
    ),
    "valve_stuck_open, exhaust, moving": Scenario(
        one("valve_stuck_open", _EXHAUST),
        "a loss that heat cannot explain",
        _SENSORS,
        3,
        "implausible sensor: muscle_pressure_pa falls to",
        visible=None,
    ),
    "valve_stuck_closed, inlet, filling": Scenario(
        one("valve_stuck_closed", _INLET),
        "no rise in 0.2 s; in hold no valve is asked to open",
        _SENSORS,
        3,
        "the inlet (stuck",
        when="filling",
        after=10,
        visible=None,
    ),
    "valve_stuck_closed, exhaust, venting": Scenario(
        one("valve_stuck_closed", _EXHAUST),
        "no fall in 0.8 s; the muscle stays full, the sentence says so",
        _LOGIC,
        23,
        "exhaust stuck closed while venting",
        when="venting",
        after=5,
        stuck=("exhaust",),
        visible=None,
        settings=NOT_LONG,
    ),
    "knee: valve_stuck_open, ppam inlet": Scenario(
        one("valve_stuck_open", "cmd_ppam_inlet_open"),
        "a gain that neither heat nor motion can explain",
        _SENSORS,
        23,
        "implausible sensor: ppam_pressure_pa rises to",
        rig="knee",
        stuck=("inlet of 1",),
        visible=None,
        settings=NOT_LONG,
    ),
    "leak, 5 /s": Scenario(
        one("leak"),
        "a loss that heat cannot explain",
        _SENSORS,
        3,
        "muscle (burst, hose off)",
        visible=None,
    ),
    "leak, 0.2 /s": Scenario(
        one("leak", value=0.2), "a drift of more than 3 kPa: an event", _LOGIC, 0, "drifted by -"
    ),
    "supply_lost, filling": Scenario(
        one("supply_lost"),
        "no rise in 0.2 s with the inlet open",
        _SENSORS,
        3,
        "the supply",
        when="filling",
        after=10,
        visible=None,
    ),
    "supply_lost, half filled": Scenario(
        one("supply_lost"),
        "it rose and stopped short",
        _SENSORS,
        3,
        "the supply",
        when="filling",
        after=250,
        pressure="250 kPa gauge",
        visible=None,
    ),
    "supply_lost, moving": Scenario(
        one("supply_lost"), "no valve is open to it: seen at the next filling", _NOBODY, 0
    ),
    "drive_fault": Scenario(
        one("drive_fault"),
        "",
        _DRIVE,
        3,
        "the drive left operation enabled by itself: fault reaction active (error 0x2310"
        " over-current)",
        again=True,
        stop=OFF,
    ),
    "sto": Scenario(
        one("sto"), "", _DRIVE, 3, "(error 0x8A88 safe torque off (STO) active)", stop=OFF
    ),
    "following_error": Scenario(
        one("following_error"),
        "the drive brakes before it takes its power away",
        _DRIVE,
        3,
        "(error 0x8611 following error)",
        within=BRAKING_CYCLES,
        stop=OFF,
    ),
    "analog: drive_fault": Scenario(
        one("drive_fault", cycles=100_000),
        "a drive on wires says nothing; the muscle pulls the motor back, away from what is"
        " asked for",
        _FOLLOWING,
        3,
        "following error: motor_travel_m",
        rig="bench_analog",
        visible=None,
        stop=OFF,
    ),
}
