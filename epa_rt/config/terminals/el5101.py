"""EL5101: incremental encoder, RS422 or TTL, with a counter of 32 bits.

Sources: identity and revisions as listed from Beckhoff's ESI files
(https://github.com/linuxcnc-ethercat/esi-data, devices/EL5101.md; older ones have another object
dictionary and are refused); PDOs of its enhanced mode, "Standard 32 Bit": 0x1A04 of ten bytes and
0x1603 of six (https://infosys.beckhoff.com/content/1033/el5101/10715105803.html); their objects
0x6010 as in its sibling (https://infosys.beckhoff.com/content/1033/ej5101/3413649419.html), 0x7010
as in 'Legacy EL5101' (https://infosys.beckhoff.com/content/1033/el5102/7882771723.html).

Bits 6 (open circuit), 14 (invalid) and 15 (toggle) of its status word stand where an analog input
has error, invalid and toggle. The master's control word stays 0: nothing latches or sets the
counter. Not found: 0x8010:0B to 0D as delivered, which switch the search for open circuits; written
here. Uncertain: the sync managers' addresses, and that the toggle flips in every cycle.
"""

from epa_rt.config.terminal import (
    BECKHOFF,
    GAP,
    INPUTS,
    OUTPUTS,
    STATUS_ERROR,
    STATUS_INVALID,
    UNASSIGNED,
    Device,
    Entry,
    Mapped,
    Pdo,
    Record,
    Sampling,
    Setting,
    Startup,
    SyncManager,
)
from epa_rt.config.terminal_families import MAILBOX

OPEN_CIRCUIT = 0x8010, (0x0B, 0x0C, 0x0D)  # search on channels A, B and C
_STATUS = (
    (0x01, "Latch C valid"),
    (0x02, "Latch extern valid"),
    (0x03, "Set counter done"),
    (0x04, "Counter underflow"),
    (0x05, "Counter overflow"),
    (0x06, "Status of input status"),
    (0x07, "Open circuit"),
    (0x08, "Extrapolation stall"),
    (0x09, "Status of input A"),
    (0x0A, "Status of input B"),
    (0x0B, "Status of input C"),
    (0x0C, "Status of input gate"),
    (0x0D, "Status of extern latch"),
    (0x0E, "Sync error"),
    (0x0F, "TxPDO State"),
    (0x10, "TxPDO Toggle"),
)


def _inputs(code: str) -> tuple[Mapped, ...]:
    return (
        *(Mapped(0x6010, subindex, "?", name) for subindex, name in _STATUS),
        Mapped(0x6010, 0x11, code, "Counter value"),
        Mapped(0x6010, 0x12, code, "Latch value"),
    )


def _outputs(code: str) -> tuple[Mapped, ...]:
    names = "Enable latch C", "Enable latch extern +", "Set counter", "Enable latch extern -"
    return (
        *(Mapped(0x7010, subindex, "?", name) for subindex, name in enumerate(names, 1)),
        Mapped(0, 0, GAP, gap=12),
        Mapped(0x7010, 0x11, code, "Set counter value"),
    )


TERMINAL = Device(
    "EL5101",
    BECKHOFF,
    (0x13ED3052,),
    (0x03F90000, 0x04000000),
    outputs=(
        Entry("control", "H", index=0x7010, subindex=0x01),
        Entry("set_counter", "i", "count", 1.0, 0x7010, 0x11),
    ),
    inputs=(
        Entry(
            "counter_status", "H", index=0x6010, subindex=0x01, faults=STATUS_ERROR | STATUS_INVALID
        ),
        Entry("counter", "i", "count", 1.0, 0x6010, 0x11),
        Entry("latch", "i", "count", 1.0, 0x6010, 0x12),
    ),
    pdos=(
        Pdo(0x1602, "ENC RxPDO-Map Control compact", _outputs("H"), 2),
        Pdo(0x1603, "ENC RxPDO-Map Control", _outputs("I"), UNASSIGNED),
        Pdo(0x1A03, "ENC TxPDO-Map Status compact", _inputs("H"), 3),
        Pdo(0x1A04, "ENC TxPDO-Map Status", _inputs("I"), UNASSIGNED),
    ),
    sync_managers=(
        *MAILBOX,
        SyncManager(0x1100, 4, 0x24, 0x01, OUTPUTS),
        SyncManager(0x1180, 6, 0x20, 0x01, INPUTS),
    ),
    records=(
        Record(
            0x8010,
            "ENC Settings",
            (
                Setting(0x01, "Enable C reset", "?", high=1),
                Setting(0x02, "Enable extern reset", "?", high=1),
                Setting(0x03, "Enable up/down counter", "?", high=1),
                Setting(0x0B, "Error detection A", "?", 1, high=1),
                Setting(0x0C, "Error detection B", "?", 1, high=1),
                Setting(0x0D, "Error detection C", "?", high=1),
                Setting(0x0E, "Reversion of rotation", "?", high=1),
            ),
        ),
    ),
    startup=tuple(
        Startup(OPEN_CIRCUIT[0], subindex, "u8", int(subindex != 0x0D))
        for subindex in OPEN_CIRCUIT[1]
    ),
    device_type=0x01FF1389,
    ebus_ma=130,
    channels=1,
    process_name="ENC Ch.",
    chooses=True,
    sampling=Sampling(),
)
