"""EL3004: four analog inputs of +-10 V, 12 bits presented in 16.

Sources: Beckhoff ESI description (identity as in public captures); documentation of EL30xx: status
word, limits (underrange at the lower end of a bipolar terminal), conversion of four channels in
about 0.625 ms, filter on at 50 Hz as delivered.
"""

from epa_rt.config.terminal import Sampling
from epa_rt.config.terminal_families import CONVERTS_12_BITS, analog_inputs

TERMINAL = analog_inputs(
    "EL3004",
    0x0BBC3052,
    (0x00100000, 0x00160000),
    emulated=0x00150000,
    unit="V",
    zero=0.0,
    full=10.0,
    sampling=Sampling(CONVERTS_12_BITS, 625e-6, broken_wire=-10.0, has_filter=True),
)
