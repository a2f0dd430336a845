"""What only the drive itself can tell: its units and limits, compared with the rig file before
anything moves.

Source: maxon EPOS4 firmware specification (0x3000, 0x3001, 0x3010, 0x6076, 0x60A8, 0x60A9, 0x60C2).
"""

import struct

from drivers.mailbox import Mailbox
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Slave
from epa_rt.config.rig_checks import entries_of

SPEED_IN_RPM, POSITION_IN_INCREMENTS = 0x00B44700, 0x00B50000
_SAME = 0.01  # torque constant and nominal current are rounded by the drive
_OVER = 1.001


def check_drive(mailbox: Mailbox, slave: Slave, rig: Rig) -> list[str]:
    """Raises BackendError for the first unit or limit that differs; gives sentences on what could
    not be compared.
    """
    notes: list[str] = []
    names = {entry.name for outputs in (True, False) for entry in entries_of(slave, outputs)}
    _check_units(mailbox, names)
    if names & {"torque", "target_torque"}:
        _check_torque(mailbox, slave)
    _check_currents(mailbox, rig, notes)
    _check_encoder(mailbox, slave, notes)
    if entries_of(slave, outputs=True):
        set_interpolation_time(mailbox, rig.period_s)
    return notes


def _check_units(mailbox: Mailbox, names: set[str]) -> None:
    speed, position = mailbox.number_if_there(0x60A9), mailbox.number_if_there(0x60A8)
    if speed not in (None, SPEED_IN_RPM) and names & {"speed", "target_speed"}:
        raise BackendError(
            f"found the speed unit 0x{speed:08X} (0x60A9) in {mailbox.label}, expected"
            f" 0x{SPEED_IN_RPM:08X}, rpm: set it in EPOS Studio, or by 'startup: [{{object:"
            f" 0x60A9:00, type: u32, value: {SPEED_IN_RPM}}}]'"
        )
    if position not in (None, POSITION_IN_INCREMENTS) and names & {"position", "target_position"}:
        raise BackendError(
            f"found the position unit 0x{position:08X} (0x60A8) in {mailbox.label}, "
            f"expected 0x{POSITION_IN_INCREMENTS:08X}, increments"
        )


def _check_torque(mailbox: Mailbox, slave: Slave) -> None:
    rated_n_m = mailbox.number(0x6076) * 1e-6
    if rated_n_m == 0.0:
        raise BackendError(
            f"found a rated torque of zero (0x6076) in {mailbox.label}, expected"
            f" {slave.rated_torque * 1e3:g} mNm: its motor data have not been set"
        )
    if abs(rated_n_m - slave.rated_torque) > _SAME * slave.rated_torque:
        raise BackendError(
            f"found a rated torque of {rated_n_m * 1e3:.4g} mNm (0x6076) in {mailbox.label}, "
            f"expected the rig file's {slave.rated_torque * 1e3:.4g} mNm"
        )


def _check_currents(mailbox: Mailbox, rig: Rig, notes: list[str]) -> None:
    """The drive's own limits must not be wider than what the rig allows."""
    limits = rig.row(rig.motor.current).limits if rig.motor.current else None
    for subindex, name, allowed_a in (
        (0x01, "nominal current", rig.safety.i2t.continuous if rig.safety.i2t else None),
        (0x02, "output current limit", limits[1] if limits else None),
    ):
        found = mailbox.number_if_there(0x3001, subindex)
        if found is None:
            notes.append(f"{mailbox.label} does not tell its {name} (0x3001:{subindex:02X})")
        elif allowed_a is not None and found * 1e-3 > _OVER * allowed_a:
            raise BackendError(
                f"found the {name} {found * 1e-3:.4g} A (0x3001:{subindex:02X}) in {mailbox.label},"
                f" expected at most the rig file's {allowed_a:.4g} A"
            )


def _check_encoder(mailbox: Mailbox, slave: Slave, notes: list[str]) -> None:
    """Main sensor resolution, or else four counts per pulse of incremental encoder 1."""
    counts, where = mailbox.number_if_there(0x3000, 0x05), "0x3000:05"
    if not counts:
        pulses, where = mailbox.number_if_there(0x3010, 0x01), "0x3010:01"
        counts = 4 * pulses if pulses else None
    if counts is None:
        notes.append(f"{mailbox.label} does not tell the resolution of its encoder")
    elif counts != slave.counts_per_turn:
        raise BackendError(
            f"found {counts} encoder counts per turn ({where}) in {mailbox.label}, "
            f"expected the rig file's {slave.counts_per_turn}"
        )


def interpolation_time(period_s: float) -> tuple[int, int]:
    """The cycle as 0x60C2 holds it: value (1 to 255) and power of ten. Raises BackendError where it
    does not fit.
    """
    for exponent in (-3, -4, -5, -6):
        value = round(period_s / 10.0**exponent)
        if 1 <= value <= 255 and abs(value * 10.0**exponent - period_s) < 1e-9:
            return value, exponent
    raise BackendError(
        f"found a period of {period_s * 1e3:g} ms, expected one that the drive's interpolation time"
        " 0x60C2 can hold"
    )


def set_interpolation_time(mailbox: Mailbox, period_s: float) -> None:
    """The drive expects a new target once per this time."""
    value, exponent = interpolation_time(period_s)
    mailbox.set(0x60C2, 0x01, struct.pack("<B", value))
    mailbox.set(0x60C2, 0x02, struct.pack("<b", exponent))
