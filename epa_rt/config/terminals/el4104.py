"""EL4104: four analog outputs of 0 to 10 V, 16 bits.

Sources: identity and revisions as listed from Beckhoff's ESI files
(https://github.com/linuxcnc-ethercat/esi-data, devices/EL4104.md); the value at subindex 1 in most
EL4xxx (https://github.com/linuxcnc-ethercat/linuxcnc-ethercat/issues/257): the driver takes 1 and
0x11 alike. Not found: its watchdog's objects, taken from EL40xx; the driver reads them, and notes
what a terminal does not tell.
"""

from epa_rt.config.terminal_families import analog_outputs

TERMINAL = analog_outputs(
    "EL4104",
    0x10083052,
    (0x03F80000, 0x03FC0000),
    unit="V",
    full=10.0,
    low=0,
    step=1,
    subindex=0x01,
)
