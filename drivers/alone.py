"""What an analog output does by itself once its master is gone, held against what safe means
(docs/decisions/0003) before anything moves. The drive's own reactions: drivers/reactions.py.

Sources: Beckhoff EL40xx documentation, watchdog function (0x80n0:05, :13, :14).
"""

from drivers.mailbox import Mailbox
from drivers.words import startup_line
from epa_rt.backend import BackendError
from epa_rt.config.rig import Slave

_RAMP, _HOLD = 1, 2  # 0x80n0:05; 0 goes to the default output at once
_RAMP_DIGITS_MS = (
    32_767 // 100
)  # from 10 V to 0 V in a tenth of a second, as long as the watchdog itself takes


def check_alone(mailbox: Mailbox, slave: Slave) -> list[str]:
    """Raises BackendError where an analog output would hold its voltage, or go elsewhere than to
    zero, without its master; gives sentences on what it does not tell.
    """
    alone = slave.description.alone
    if alone is None:
        if slave.description.is_generic and slave.description.outputs:
            return [
                f"{mailbox.label} is described by its rig file alone, which does not tell what its"
                " outputs do without their master: pull its cable with the air off, and see"
            ]
        return []
    notes = []
    for n in range(slave.description.channels):
        index = 0x8000 + 0x10 * n
        does = mailbox.number_if_there(index, alone.reaction)
        goes_to = mailbox.number_if_there(index, alone.default)
        if does is not None and does >= _HOLD:
            raise BackendError(
                f"found 0x{index:04X}:05 = {does} in {mailbox.label}, channel {n + 1} holds its"
                " voltage when its master is gone, expected 0 (default output): "
                + startup_line(f"0x{index:04X}:05", "u8", 0)
            )
        if goes_to:
            raise BackendError(
                f"found 0x{index:04X}:13 = {_signed(goes_to)} in {mailbox.label}, where channel"
                f" {n + 1} goes when its master is gone, expected 0, no voltage: "
                + startup_line(f"0x{index:04X}:13", "i16", 0)
            )
        if does is None or goes_to is None:
            notes.append(
                f"{mailbox.label} does not tell what channel {n + 1} does without its master"
                f" (0x{index:04X}:05, :13): pull its cable with the air off, and see"
            )
        elif does == _RAMP and (ramp := mailbox.number(index, alone.ramp)) < _RAMP_DIGITS_MS:
            raise BackendError(
                f"found 0x{index:04X}:14 = {ramp} digits/ms in {mailbox.label}, the ramp to no"
                f" voltage when its master is gone, expected {_RAMP_DIGITS_MS} at least (0.1 s from"
                f" 10 V), or no ramp: {startup_line(f'0x{index:04X}:05', 'u8', 0)}"
            )
    return notes


def _signed(number: int) -> int:
    return number - (1 << 16) if number >= 1 << 15 else number
