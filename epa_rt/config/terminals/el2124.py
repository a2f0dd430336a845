"""EL2124: four digital outputs of 5 V.

Sources: Beckhoff ESI description (identity as in public captures), documentation of EL21xx.
"""

from epa_rt.config.terminal_families import digital_outputs

TERMINAL = digital_outputs("EL2124", 0x084C3052, (0x00100000, 0x00120000), channels=4, ebus_ma=130)
