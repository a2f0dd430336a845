"""EL4034: four analog outputs of +-10 V, 12 bits presented in 16.

Sources: Beckhoff ESI description (identity as in public captures); documentation of EL40xx: fixed
process data, watchdog (0x80n0:05, :13, :14). Revision 0x00120000 has its value at subindex 1.
"""

from epa_rt.config.terminal_families import analog_outputs

TERMINAL = analog_outputs(
    "EL4034",
    0x0FC23052,
    (0x00100000, 0x00150000),
    emulated=0x00140000,
    unit="V",
    full=10.0,
    at_one=(0x00120000,),
)
