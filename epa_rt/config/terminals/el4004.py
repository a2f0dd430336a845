"""EL4004: four analog outputs of 0 to 10 V, 12 bits presented in 16.

Sources: identity, revisions, and that each has the process data of EL4034's revision of the same
number, as listed from Beckhoff's ESI files (https://github.com/linuxcnc-ethercat/esi-data,
devices/EL4004.md); documentation of EL40xx (watchdog, fixed process data), which covers both. Its
E-bus current and sync manager addresses are taken from EL4034.
"""

from epa_rt.config.terminal_families import analog_outputs

TERMINAL = analog_outputs(
    "EL4004",
    0x0FA43052,
    (0x00100000, 0x00150000),
    emulated=0x00140000,
    unit="V",
    full=10.0,
    low=0,
    at_one=(0x00120000,),
)
