"""Settings of an analog terminal's channels that change what a count means: as they leave the
maker, or nothing is believed.

Sources: Beckhoff EL30xx and EL40xx documentation (0x80n0:01 user scale, :02 presentation, :05
Siemens bits of an input).
"""

from drivers.mailbox import Mailbox
from drivers.words import startup_line
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Slave


def channels_of(rig: Rig, slave: Slave) -> list[int]:
    """The channels, from 1, that rows of the rig file stand for."""
    places = (row.entry.split(".") for row in rig.signals)
    return sorted(
        {
            int(entry.removeprefix("ch").removesuffix("_status"))
            for name, entry in places
            if name == slave.name
        }
    )


def check_channels(mailbox: Mailbox, slave: Slave, rig: Rig) -> None:
    """Raises BackendError where a count would not be what the table takes it for; what a revision
    does not have is passed over.
    """
    neutral = slave.description.neutral
    if not neutral:
        return
    for channel in channels_of(rig, slave):
        index = 0x8000 + 0x10 * (channel - 1)
        for subindex, name in neutral:
            if found := mailbox.number_if_there(index, subindex):
                place = f"0x{index:04X}:{subindex:02X}"
                raise BackendError(
                    f"found {place} = {found} in {mailbox.label}, the {name} of channel {channel},"
                    " with which a count means something else than in the table, expected 0:"
                    f" {startup_line(place, 'u8', 0)}"
                )
