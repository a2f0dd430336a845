"""The kinds of faults of a bus, and all that an emulator offers."""

from sim_backend.bus import registers as reg
from sim_backend.faults import PLANT_FAULTS, FaultKind

FRAME_FAULTS: dict[str, FaultKind] = {
    "frames_lost": FaultKind(
        "frames are lost; leg=out: before the slaves see them, leg=back: on the way back",
        "",
        None,
        "",
        1,
    ),
    "frames_late": FaultKind("frames come back this much later", "", 0.002, "s", 1),
    "frames_repeated": FaultKind("every frame comes back twice", "", None, "", 1),
    "frames_reordered": FaultKind(
        "a frame comes back after the one that follows it", "", None, "", 1
    ),
    "frames_damaged": FaultKind(
        "headers, index, counter or length of a frame are damaged on the way back", "", None, "", 1
    ),
    "wrong_working_counter": FaultKind(
        "this is added to the working counter of process data", "", -1.0, "", 1
    ),
    "cable_pulled": FaultKind("no frame gets through, in either direction", "", None, "", None),
}
SLAVE_FAULTS: dict[str, FaultKind] = {
    "slave_lost": FaultKind(
        "a slave loses its power, and what hangs behind it its frames (alone=true: only itself); it"
        " comes back in INIT",
        "slave",
        None,
        "",
        None,
    ),
    "slave_falls": FaultKind(
        "a slave falls to SAFEOP with this AL status code",
        "slave",
        float(reg.SYNC_ERROR),
        "code",
        1,
    ),
    "sdo_refused": FaultKind(
        "a slave aborts every access to the object with this index",
        "slave with a mailbox",
        float(0x1C12),
        "index",
    ),
    "sdo_forgotten": FaultKind(
        "a slave confirms what is written to this object and keeps the old value",
        "slave with a mailbox",
        float(0x1C12),
        "index",
    ),
    "clock_drift": FaultKind(
        "a slave's clock (default: the reference) runs this much fast",
        "slave with a clock",
        50.0,
        "ppm",
    ),
}
BUS_FAULTS = {**FRAME_FAULTS, **SLAVE_FAULTS}
ALL_FAULTS = {**BUS_FAULTS, **PLANT_FAULTS}
