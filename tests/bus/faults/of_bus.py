"""Scenarios: faults of frames, slaves, cable and clock."""

from tests.bus.faults.scenarios import ALONE, OFF, WATCHDOG_CYCLES, Scenario, one

_COUNTER = "loop: working counter"
_STATES = "driver: states of the slaves, every 10 ms"
_MISSING = "driver: working counter, then the states at once"
_SILENT = "driver: 3 frames in a row stayed away"
_WATCHDOG = "the slaves' watchdogs"
PATIENT = {
    "safety": {"watchdog": "1 s"},
    "master": {"frame_timeout": "100 ms"},
}  # for a busy test machine

SCENARIOS: dict[str, Scenario] = {
    "frames_lost, 1 on its way out": Scenario(
        one("frames_lost"), "the drive holds its last target for a cycle", _COUNTER, 0, bad_cycles=1
    ),
    "frames_lost, 1 on its way back": Scenario(
        one("frames_lost", leg="back"),
        "the last good inputs stand in for a cycle",
        _COUNTER,
        0,
        bad_cycles=1,
    ),
    "frames_lost, 3": Scenario(
        one("frames_lost", cycles=3),
        "three frames in a row do not come back",
        _SILENT,
        64,
        "no frame came back from ve0 in 3 cycles in a row",
        again=True,
        stop=OFF,
    ),
    "frames_repeated, 5": Scenario(
        one("frames_repeated", cycles=5),
        "second copies have a known index and are thrown away",
        "SOEM: frame index",
        0,
    ),
    "frames_reordered": Scenario(
        one("frames_reordered"),
        "a frame that comes after the next one counts as lost",
        _COUNTER,
        0,
        bad_cycles=1,
    ),
    "frames_damaged, 1": Scenario(
        one("frames_damaged"), "the frame is not believed", _COUNTER, 0, bad_cycles=1
    ),
    "frames_damaged, 60": Scenario(
        one("frames_damaged", cycles=60),
        "until three in a row cannot be believed",
        "driver or loop, whichever sees three first",
        3,
        "lost working counter",
        visible=None,
        stop=OFF,
    ),
    "wrong_working_counter, 1": Scenario(
        one("wrong_working_counter"), "the frame is not believed", _COUNTER, 0, bad_cycles=1
    ),
    "wrong_working_counter, 9": Scenario(
        one("wrong_working_counter", cycles=9),
        "the loop trips on the third",
        _COUNTER,
        3,
        "lost working counter: the working counter was wrong in 3 cycles in a row",
        stop=OFF,
    ),
    "slave_lost, valves": Scenario(
        one("slave_lost", "valves"),
        "the terminals behind it are cut off too",
        _MISSING,
        64,
        "valves (slave 2, EL2124) does not answer any more: its supply, or the cable behind"
        " coupler",
        stop=OFF,
    ),
    "slave_lost, analog_in alone": Scenario(
        one("slave_lost", "analog_in", alone=True),
        "",
        _MISSING,
        64,
        "analog_in (slave 3, EL3004) does not answer any more",
        stop=OFF,
    ),
    "slave_lost, drive": Scenario(
        one("slave_lost", "drive"),
        "no supply, no torque",
        _MISSING,
        74,
        "drive (slave 5, EPOS4) does not answer any more",
        stop=OFF,
    ),
    "slave_lost, coupler": Scenario(
        one("slave_lost", "coupler"),
        "nothing is reached; as a pulled cable",
        f"{_SILENT}; outputs: {_WATCHDOG}",
        74,
        "no frame came back from ve0 in 3 cycles in a row",
        within=WATCHDOG_CYCLES,
        stop=ALONE,
    ),
    "slave_falls, analog_in": Scenario(
        one("slave_falls", "analog_in"),
        "it still counts in the working counter",
        _STATES,
        64,
        "analog_in (slave 3, EL3004) left OP: it is in SAFEOP with error (0x001A synchronisation"
        " error)",
        stop=OFF,
    ),
    "slave_falls, valves, 0x001B": Scenario(
        one("slave_falls", "valves", value=0x1B),
        "",
        _STATES,
        64,
        "valves (slave 2, EL2124) left OP: it is in SAFEOP with error (0x001B",
        stop=OFF,
    ),
    "slave_falls, drive, 0x002C": Scenario(
        one("slave_falls", "drive", value=0x2C),
        "the drive's own fault reaction, seen in its status word",
        "loop: drive state",
        74,
        "drive (slave 5, EPOS4) left OP: it is in SAFEOP with error (0x002C",
        again=True,
        stop=ALONE,
    ),
    "cable_pulled": Scenario(
        one("cable_pulled"),
        "nothing can be sent any more",
        f"{_SILENT}; outputs: {_WATCHDOG}",
        74,
        "no frame came back from ve0 in 3 cycles in a row: its cable, its link, or the supply of"
        " coupler",
        within=WATCHDOG_CYCLES,
        stop=ALONE,
    ),
    "sdo_refused, drive": Scenario(
        one("sdo_refused", "drive", value=0x1600),
        "at bring-up: no output is written",
        "driver: mapping read back",
        4,
        "object 0x1600:00 of drive (slave 5, EPOS4)",
        when="start",
        after=0,
    ),
    "sdo_forgotten, drive": Scenario(
        one("sdo_forgotten", "drive", value=0x1600),
        "at bring-up: no output is written",
        "driver: what is written is read back",
        4,
        "drive (slave 5, EPOS4)",
        when="start",
        after=0,
    ),
    "knee: frames_lost, 1": Scenario(
        one("frames_lost"),
        "position mode: the target that comes next is two steps on",
        _COUNTER,
        0,
        rig="knee",
        bad_cycles=1,
    ),
    "knee: frames_lost, 3": Scenario(
        one("frames_lost", cycles=3), "", _SILENT, 64, "no frame came back", rig="knee", stop=OFF
    ),
    "mass: slave_lost, drive": Scenario(
        one("slave_lost", "drive"),
        "",
        _MISSING,
        74,
        "drive (slave 5, EPOS4) does not answer any more",
        rig="mass",
        stop=OFF,
    ),
    "analog: slave_falls, analog_out": Scenario(
        one("slave_falls", "analog_out"),
        "speed and enable of a wired drive come from the terminals",
        _STATES,
        64,
        "analog_out (slave 4, EL4034) left OP",
        rig="bench_analog",
        stop=OFF,
    ),
    "analog: cable_pulled": Scenario(
        one("cable_pulled"),
        "the enable output falls with its terminal's watchdog",
        f"{_SILENT}; outputs: {_WATCHDOG}",
        74,
        "no frame came back",
        rig="bench_analog",
        within=WATCHDOG_CYCLES,
        stop=OFF,
    ),
}

# In real time: what needs a clock. A busy machine may add bad cycles of its own.
REAL_TIME: dict[str, Scenario] = {
    "frames_late, 2 ms and 300 ms": Scenario(
        (*one("frames_late"), *one("frames_late", value=0.3, after=100)),
        "waited for up to `frame_timeout`: late cycles; later than that: lost",
        "driver: time-out; loop: overruns",
        0,
        real_time=True,
        settings=PATIENT,
        bad_cycles=1,
    ),
    "clock_drift, 50 ppm": Scenario(
        (
            *one("clock_drift"),
            *one("frames_repeated", cycles=5, after=300),
            *one("frames_reordered", after=500),
        ),
        "the cycle follows the reference clock; old frames are known by its time",
        "driver: PI loop",
        0,
        real_time=True,
        settings=PATIENT,
        bad_cycles=1,
    ),
    "cable_pulled, in real time": Scenario(
        one("cable_pulled"),
        "",
        f"driver: nothing got through for longer than the watchdog; outputs: {_WATCHDOG}",
        74,
        "no process data reached the slaves for ",
        within=WATCHDOG_CYCLES + 3,
        stop=ALONE,
        real_time=True,
        settings={"master": {"frame_timeout": "60 ms"}},
    ),
}
