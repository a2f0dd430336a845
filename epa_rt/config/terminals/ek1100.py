"""EK1100: EtherCAT coupler. No process data; in most racks it is the reference clock.

Sources: Beckhoff ESI description, identity as in public captures; documentation of EK1100.
"""

from epa_rt.config.terminal import BECKHOFF, Device

TERMINAL = Device(
    "EK1100", BECKHOFF, (0x044C2C52,), (0x00000000, 0x00120000), ebus_ma=-2000, is_coupler=True
)
