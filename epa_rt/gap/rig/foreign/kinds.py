"""The kinds of rig that are known. Your own: one more module with a ``Component``, one more line
here.
"""

from epa_rt.gap.rig.foreign import carriage, chamber, piston, servo, shaft
from epa_rt.gap.rig.foreign.component import Component

KINDS: dict[str, Component] = {
    module.COMPONENT.kind: module.COMPONENT for module in (carriage, chamber, piston, servo, shaft)
}
