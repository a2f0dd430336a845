"""EL2008: eight digital outputs of 24 V, 0.5 A.

Sources: identity, revisions and process data as listed from Beckhoff's ESI files
(https://github.com/linuxcnc-ethercat/esi-data, devices/EL2008.md; `ethercat cstruct` of one in
abhinayh56/EtherCAT_layer, src/Ec_slave/Ec_slave_el_2008_info.h). Not found, taken from EL2124:
control byte of its sync manager and E-bus current, which only the emulation uses.
"""

from epa_rt.config.terminal_families import digital_outputs

TERMINAL = digital_outputs("EL2008", 0x07D83052, (0x00100000, 0x00120000), channels=8, ebus_ma=130)
