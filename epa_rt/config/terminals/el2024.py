"""EL2024: four digital outputs of 24 V, 2 A, for valves with large coils.

Sources: identity, revisions, and that its process data are EL2124's, as listed from Beckhoff's ESI
files (https://github.com/linuxcnc-ethercat/esi-data, devices/EL2024.md). Not found, taken from
EL2124: control byte of its sync manager and E-bus current, which only the emulation uses.
"""

from epa_rt.config.terminal_families import digital_outputs

TERMINAL = digital_outputs("EL2024", 0x07E83052, (0x00100000, 0x00130000), channels=4, ebus_ma=130)
