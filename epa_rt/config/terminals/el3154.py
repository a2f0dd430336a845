"""EL3154: four analog inputs of 4 to 20 mA, 16 bits.

Sources: identity, revisions, and that revisions 2 to 4 have EL3104's process data, as listed from
Beckhoff's ESI files (https://github.com/linuxcnc-ethercat/esi-data, devices/EL3154.md); error about
0.5 mA below 4 and above 20 mA
(https://infosys.beckhoff.com/content/1033/epp31xx/6326400651.html, a sibling in another housing);
limited to 0 below its range (EL30xx documentation, as EL3064). Filter as EL30xx, which the EL31xx
documentation describes in the same objects.

Uncertain until a real one corrects it: whether values between 3.5 and 4 mA are shown as negative
counts (taken here) or as 0; either way a wire that breaks is an error of the terminal. The
conversion time, 0.625 ms with the 50 Hz filter off, is EL3004's, not found for this one.
"""

from epa_rt.config.terminal import Sampling
from epa_rt.config.terminal_families import FULL_SCALE, analog_inputs

ERROR = FULL_SCALE // 32  # counts of 0.5 mA

TERMINAL = analog_inputs(
    "EL3154",
    0x0C523052,
    (0x00120000, 0x00140000),
    unit="mA",
    zero=4.0,
    full=20.0,
    low=-ERROR,
    sampling=Sampling(
        1,
        625e-6,
        under=-ERROR,
        floor=0,
        over_error=FULL_SCALE + ERROR,
        broken_wire=0.0,
        has_filter=True,
    ),
)
