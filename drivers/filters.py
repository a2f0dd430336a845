"""The digital filter of an analog input: set as the rig file says, off by default, and how much its
values lag then.

Source: Beckhoff EL30xx and EL31xx documentation, filter operation (0x8000:06 enables, 0x8000:15
chooses, both of channel 1 for all channels; FIR notch filters average over one period of the
mains, IIR filters are low-passes of first order computed every 0.5 ms in a terminal of four
channels).
"""

import math
from collections.abc import Callable

from drivers.mailbox import Mailbox, u8, u16
from epa_rt.config.rig import Slave

SETTINGS, ENABLE, CHOICE = 0x8000, 0x06, 0x15
FIR_HZ = (50.0, 60.0)  # choices 0 and 1
IIR_HZ = (400.0, 220.0, 100.0, 50.0, 24.0, 12.0, 6.2, 3.0)  # -3 dB; choices 2 to 9
NAMES = ("50 Hz", "60 Hz", *(f"IIR {n}" for n in range(1, 9)))


def lag_s(choice: int | None) -> float:
    """How late a slow change shows, in s, beside the conversion itself; ``None``: filter off."""
    if choice is None:
        return 0.0
    if choice < len(FIR_HZ):
        return 0.5 / FIR_HZ[choice]
    return 1.0 / (2.0 * math.pi * IIR_HZ[choice - len(FIR_HZ)])


def filter_writes(slave: Slave) -> list[tuple[int, bytes]]:
    """Subindex and value of what is written into 0x8000; empty where ``startup`` sets it itself."""
    if not _has_filter(slave) or _is_given(slave):
        return []
    if slave.filter == "off":
        return [(ENABLE, u8(0))]
    return [(CHOICE, u16(NAMES.index(slave.filter))), (ENABLE, u8(1))]


def set_filter(mailbox: Mailbox, slave: Slave) -> list[str]:
    """Writes the filter and reads it back, in PREOP. Gives one note: which filter works, and how
    late the terminal's values are. Raises BackendError where a value is not kept.
    """
    sampling = slave.description.sampling
    if sampling is None or not sampling.has_filter:
        return []
    for subindex, data in filter_writes(slave):
        if not mailbox.set_if_there(SETTINGS, subindex, data):
            return [f"{mailbox.label} does not tell its filter (0x8000:{subindex:02X})"]
    is_on = mailbox.number_if_there(SETTINGS, ENABLE)
    choice = mailbox.number_if_there(SETTINGS, CHOICE) if is_on else None
    late_ms = 1e3 * sampling.conversion_s
    if is_on is None:
        return [f"{mailbox.label} does not tell its filter (0x8000:06)"]
    if not is_on:
        return [f"{mailbox.label} has its filter off: values are {late_ms:.1f} ms old at most"]
    if choice is None or choice >= len(NAMES):
        return [f"{mailbox.label} has a filter on whose lag is not known (0x8000:15 = {choice})"]
    return [
        f"{mailbox.label} has its filter on ({NAMES[choice]}): its values lag by"
        f" {1e3 * lag_s(choice):.1f} ms, and are {late_ms:.1f} ms older at most"
    ]


def filter_steps(mailbox: Mailbox, slave: Slave) -> list[Callable[[], object]]:
    """The same for a terminal that is taken back while the others run."""
    return [
        step
        for subindex, data in filter_writes(slave)
        for step in mailbox.steps_to_set(SETTINGS, subindex, data)
    ]


def _has_filter(slave: Slave) -> bool:
    sampling = slave.description.sampling
    return sampling is not None and sampling.has_filter


def _is_given(slave: Slave) -> bool:
    places = {sdo.place for sdo in slave.startup}
    return bool(places & {(SETTINGS, ENABLE), (SETTINGS, CHOICE)})
