"""Drive error codes (object 0x603F) in words. Source: maxon EPOS4 firmware specification, device
errors.
"""

_WORDS = {
    0x1000: "generic error",
    0x1080: "generic initialisation error",
    0x2310: "over-current",
    0x2320: "power stage protection",
    0x3210: "over-voltage",
    0x3220: "under-voltage",
    0x4210: "thermal overload",
    0x4380: "thermal motor overload",
    0x5113: "logic supply voltage too low",
    0x5280: "hardware defect",
    0x5281: "hardware incompatible",
    0x6080: "sign of life error",
    0x6180: "internal software error",
    0x6320: "software parameter error",
    0x6380: "persistent parameter corrupt",
    0x7320: "position sensor error",
    0x7380: "position sensor breach",
    0x7381: "position sensor resolution error",
    0x7388: "Hall sensor error",
    0x7390: "main sensor direction error",
    0x8110: "CAN overrun",
    0x8130: "CAN heartbeat error",
    0x8180: "EtherCAT communication error",
    0x8181: "EtherCAT initialisation error",
    0x8182: "EtherCAT receive queue overflow",
    0x8183: "EtherCAT communication internal error",
    0x8184: "EtherCAT cycle time error",
    0x8250: "process data time-out (RPDO)",
    0x8280: "EtherCAT PDO communication error",
    0x8611: "following error",
    0x8A80: "negative limit switch",
    0x8A81: "positive limit switch",
    0x8A82: "software position limit",
    0x8A88: "safe torque off (STO) active",
    0xFF01: "system overloaded",
    0xFF02: "watchdog error",
}


def drive_error_words(code: int) -> str:
    """'0x8611 following error'; an unknown code is said to be unknown."""
    return f"0x{code:04X} {_WORDS.get(code, 'a code that is not in the table')}"
