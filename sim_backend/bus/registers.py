"""Registers of an EtherCAT slave controller (ESC), AL states and AL status codes, by the names of
the field.

Sources: ETG.1000.4 and ETG.1000.6 (registers, state machine), ETG.1020 (AL status codes), Beckhoff
ESC datasheet section II (register description).
"""

TYPE, REVISION, BUILD, FMMU_COUNT, SM_COUNT, RAM_KB, PORTS, FEATURES = (
    0x0000,
    0x0001,
    0x0002,
    0x0004,
    0x0005,
    0x0006,
    0x0007,
    0x0008,
)
STATION_ADDRESS, STATION_ALIAS = 0x0010, 0x0012
DL_CONTROL, DL_STATUS = 0x0100, 0x0110
AL_CONTROL, AL_STATUS, AL_STATUS_CODE = 0x0120, 0x0130, 0x0134
PDI_CONTROL, ESC_CONFIGURATION = 0x0140, 0x0141
ERROR_COUNTERS = 0x0300
WATCHDOG_DIVIDER, WATCHDOG_PDI, WATCHDOG_DATA, WATCHDOG_STATUS, WATCHDOG_COUNT = (
    0x0400,
    0x0410,
    0x0420,
    0x0440,
    0x0442,
)
EEPROM_CONFIG, EEPROM_CONTROL, EEPROM_ADDRESS, EEPROM_DATA = 0x0500, 0x0502, 0x0504, 0x0508
FMMU, SYNC_MANAGER = 0x0600, 0x0800
DC_PORT_TIMES, DC_SYSTEM_TIME, DC_RECEIVE_TIME, DC_OFFSET, DC_DELAY, DC_DIFFERENCE = (
    0x0900,
    0x0910,
    0x0918,
    0x0920,
    0x0928,
    0x092C,
)
DC_SPEED_START, DC_FILTER = 0x0930, 0x0934
DC_CUC, DC_ACTIVATION, DC_START_TIME, DC_SYNC0_CYCLE, DC_SYNC1_CYCLE = (
    0x0980,
    0x0981,
    0x0990,
    0x09A0,
    0x09A4,
)
DIGITAL_OUTPUTS = 0x0F00
PROCESS_RAM = 0x1000
MEMORY_SIZE = 0x10000

INIT, PREOP, BOOT, SAFEOP, OP = 0x1, 0x2, 0x3, 0x4, 0x8
ERROR_FLAG = ACKNOWLEDGE = 0x10
STATE_NAMES = {INIT: "INIT", PREOP: "PREOP", BOOT: "BOOT", SAFEOP: "SAFEOP", OP: "OP"}

NO_ERROR = 0x0000
INVALID_STATE_CHANGE = 0x0011
UNKNOWN_STATE = 0x0012
BOOT_NOT_SUPPORTED = 0x0013
INVALID_MAILBOX_PREOP = 0x0016
INVALID_SYNC_MANAGER = 0x0017
SYNC_ERROR = 0x001A
SYNC_MANAGER_WATCHDOG = 0x001B
INVALID_OUTPUT_CONFIG = 0x001D
INVALID_INPUT_CONFIG = 0x001E
INVALID_WATCHDOG_CONFIG = 0x001F
NEEDS_COLD_START = 0x0020
NO_SYNC = 0x002D
INVALID_DC_SYNC = 0x0030
INVALID_DC_LATCH = 0x0031
DC_PLL_ERROR = 0x0032
INVALID_DC_CYCLE = 0x0035

# What a master may write below the process RAM, as (start, end). Everything else is read-only.
_WRITABLE = (
    (0x0010, 0x0014),
    (0x0020, 0x0022),
    (0x0030, 0x0032),
    (0x0040, 0x0042),
    (0x0100, 0x0104),
    (0x0108, 0x010A),
    (0x0120, 0x0122),
    (0x0200, 0x0202),
    (0x0300, 0x0314),
    (0x0400, 0x0402),
    (0x0410, 0x0412),
    (0x0420, 0x0422),
    (0x0442, 0x0444),
    (0x0500, 0x0501),
    (0x0502, 0x0510),
    (0x0600, 0x0700),
    (0x0900, 0x0904),
    (0x0910, 0x0918),
    (0x0920, 0x092C),
    (0x0930, 0x0936),
    (0x0980, 0x0982),
    (0x0990, 0x0998),
    (0x09A0, 0x09A8),
    (0x0F00, 0x1000),
)


def writable_map(sync_managers: int, has_clock: bool) -> bytes:
    """One byte per register address below 0x1000: 1 where a master may write."""
    table = bytearray(PROCESS_RAM)
    for start, end in _WRITABLE:
        if has_clock or not 0x0900 <= start < 0x0A00:
            table[start:end] = b"\x01" * (end - start)
    for n in range(sync_managers):
        start = SYNC_MANAGER + 8 * n
        table[start : start + 5] = b"\x01" * 5  # start, length, control
        table[start + 6] = 1  # activate; status and PDI control are the slave's
    return bytes(table)
