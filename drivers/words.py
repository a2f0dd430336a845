"""EtherCAT's numbers in words: states, AL status codes, SDO abort codes.

Sources: ETG.1000.6 and ETG.1020 (AL status codes), CiA 301 (SDO abort codes, error classes, error
register).
"""

INIT, PREOP, BOOT, SAFEOP, OP = 0x01, 0x02, 0x03, 0x04, 0x08
ERROR = 0x10

_STATES = {0: "no answer", INIT: "INIT", PREOP: "PREOP", BOOT: "BOOT", SAFEOP: "SAFEOP", OP: "OP"}

_AL_STATUS = {
    0x0001: "unspecified error",
    0x0002: "no memory",
    0x0003: "invalid device set-up",
    0x0006: "SII and firmware do not match",
    0x0007: "firmware update failed",
    0x000E: "licence error",
    0x0011: "invalid requested state change",
    0x0012: "unknown requested state",
    0x0013: "bootstrap not supported",
    0x0014: "no valid firmware",
    0x0015: "invalid mailbox configuration (BOOT)",
    0x0016: "invalid mailbox configuration (PREOP)",
    0x0017: "invalid sync manager configuration",
    0x0018: "no valid inputs available",
    0x0019: "no valid outputs",
    0x001A: "synchronisation error",
    0x001B: "sync manager watchdog: process data stayed away",
    0x001C: "invalid sync manager types",
    0x001D: "invalid output configuration",
    0x001E: "invalid input configuration",
    0x001F: "invalid watchdog configuration",
    0x0020: "slave needs a cold start",
    0x0021: "slave needs INIT",
    0x0022: "slave needs PREOP",
    0x0023: "slave needs SAFEOP",
    0x0024: "invalid input mapping",
    0x0025: "invalid output mapping",
    0x0026: "inconsistent settings",
    0x0027: "free run not supported",
    0x0028: "synchronisation not supported",
    0x0029: "free run needs three buffers",
    0x002A: "background watchdog",
    0x002B: "no valid inputs and outputs",
    0x002C: "fatal synchronisation error: SYNC0 stayed away",
    0x002D: "no synchronisation: SYNC0 has not come",
    0x002E: "cycle time too small",
    0x0030: "invalid SYNC configuration of the distributed clock",
    0x0031: "invalid latch configuration of the distributed clock",
    0x0032: "PLL error: not locked to the master",
    0x0033: "input/output error of synchronisation",
    0x0034: "synchronisation time-out",
    0x0035: "invalid sync cycle time",
    0x0036: "SYNC0 cycle time not supported",
    0x0037: "SYNC1 cycle time not supported",
    0x0041: "mailbox AoE error",
    0x0042: "mailbox EoE error",
    0x0043: "mailbox CoE error",
    0x0044: "mailbox FoE error",
    0x0045: "mailbox SoE error",
    0x004F: "mailbox VoE error",
    0x0050: "EEPROM: no access",
    0x0051: "EEPROM error",
    0x0060: "slave restarted by itself",
    0x0061: "device identification updated",
    0x00F0: "application controller available",
}

_ABORT = {
    0x05030000: "toggle bit did not alternate",
    0x05040000: "time-out",
    0x05040001: "unknown command",
    0x05040002: "invalid block size",
    0x05040005: "out of memory",
    0x06010000: "unsupported access",
    0x06010001: "attempt to read a write-only object",
    0x06010002: "attempt to write a read-only object",
    0x06010003: "subindex cannot be written while subindex 0 is not zero",
    0x06010004: "complete access not supported",
    0x06020000: "object does not exist",
    0x06040041: "object cannot be mapped to process data",
    0x06040042: "more objects than process data can hold",
    0x06040043: "incompatible parameters",
    0x06040047: "internal incompatibility",
    0x06060000: "hardware error",
    0x06070010: "length does not fit the type",
    0x06070012: "too long for the type",
    0x06070013: "too short for the type",
    0x06090011: "subindex does not exist",
    0x06090030: "value out of range",
    0x06090031: "value too large",
    0x06090032: "value too small",
    0x06090036: "maximum below minimum",
    0x08000000: "general error",
    0x08000020: "cannot be stored in the application",
    0x08000021: "cannot be stored: local control",
    0x08000022: "cannot be stored in the present state",
    0x08000023: "no object dictionary",
}

_ERROR_CLASS = {
    0x10: "generic error",
    0x20: "current",
    0x30: "voltage",
    0x40: "temperature",
    0x50: "hardware",
    0x60: "software",
    0x70: "additional modules",
    0x80: "monitoring",
    0x90: "external error",
    0xF0: "additional functions",
}
_ERROR_REGISTER = (
    "generic",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile",
    "reserved",
    "of the maker",
)

ABORT_NO_OBJECT, ABORT_NO_SUBINDEX = 0x06020000, 0x06090011


def state_words(state: int) -> str:
    """'SAFEOP with error' for 0x14; 0 is a slave that does not answer."""
    name = _STATES.get(state & 0x0F, f"an unknown state 0x{state:02X}")
    return f"{name} with error" if state & ERROR else name


def al_status_words(code: int) -> str:
    """'0x001B sync manager watchdog: process data stayed away'; an unknown code is said to be
    unknown.
    """
    unknown = "a code of the device maker" if code >= 0x8000 else "a code that is not in the table"
    return f"0x{code:04X} {_AL_STATUS.get(code, unknown)}"


def abort_words(code: int) -> str:
    """'0x06010002 attempt to write a read-only object'; an unknown code is said to be unknown."""
    return f"0x{code:08X} {_ABORT.get(code, 'an abort code that is not in the table')}"


def error_class_words(code: int) -> str:
    """'0x8611 monitoring' for an emergency's error code, by its class."""
    return f"0x{code:04X} {_ERROR_CLASS.get(code >> 8 & 0xF0, 'a class that is not in the table')}"


def error_register_words(register: int) -> str:
    """'0x21 (generic, device profile)' for an error register (0x1001)."""
    bits = [name for bit, name in enumerate(_ERROR_REGISTER) if register >> bit & 1]
    return f"0x{register:02X} ({', '.join(bits) or 'no error'})"


def startup_line(place: str, kind: str, value: int) -> str:
    """What to write in the rig file so that an object, '0x8000:05', has this value once the bus
    runs.
    """
    return (
        f"write it at start by 'startup: [{{object: {place}, type: {kind}, value: {value}}}]' in"
        " the rig file"
    )
