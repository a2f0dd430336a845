"""EL3064: four analog inputs of 0 to 10 V, 12 bits presented in 16.

Sources: identity, revisions, and that revisions 1 to 5 have the process data of EL3004's 1 to 6, as
listed from Beckhoff's ESI files (https://github.com/linuxcnc-ethercat/esi-data,
devices/EL3064.md); limits of a unipolar terminal: a value below -256 counts is under-range, an
error, and shown as 0 (https://infosys.beckhoff.com/content/1033/el30xx/1709020939.html). A broken
wire reads 0 V, which no status bit tells. Not found: whether it converts as fast as EL3004, and
where exactly its sync managers lie; both are taken from there.
"""

from epa_rt.config.terminal import Sampling
from epa_rt.config.terminal_families import CONVERTS_12_BITS, analog_inputs

UNDER_RANGE = -256  # counts

TERMINAL = analog_inputs(
    "EL3064",
    0x0BF83052,
    (0x00110000, 0x00150000),
    unit="V",
    zero=0.0,
    full=10.0,
    low=UNDER_RANGE,
    sampling=Sampling(
        CONVERTS_12_BITS, 625e-6, under=UNDER_RANGE, floor=0, broken_wire=0.0, has_filter=True
    ),
)
