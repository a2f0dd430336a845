"""What the drive does by itself when it has to stop, its homing objects and its following-error
window: written at bring-up from the rig file, and read back.

Sources: CiA 402 (0x6007, 0x605A to 0x605E, 0x6065, 0x6084, 0x6085, 0x6098, 0x6099, 0x609A), maxon
EPOS4 firmware specification (0x30B0, 0x30B1).
"""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.mailbox import Mailbox
from drivers.words import startup_line
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Slave
from epa_rt.config.rig_homing import HomingOptions, homing_here
from epa_rt.signals.drive_options import drive_options
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import Scaling, scaling_of

ABORT_CONNECTION, QUICK_STOP, SHUTDOWN, DISABLE, FAULT = 0x6007, 0x605A, 0x605B, 0x605C, 0x605E
DECELERATION, QUICK_STOP_DECELERATION = 0x6084, 0x6085
FOLLOWING_ERROR_WINDOW = 0x6065
HOMING_METHOD, HOME_POSITION, HOME_OFFSET_MOVE = 0x6098, 0x30B0, 0x30B1
HOMING_SPEEDS, HOMING_ACCELERATION = 0x6099, 0x609A
WINDOW_SHARE = 2.0  # of motor.following_error: ours trips first, the drive's own is behind it
_HOLDS = range(5, 9)  # 0x605A: from here on the drive keeps its power once it has stopped
_LETS_GO = (1, 2)  # 0x6007: fault or voltage off, a choice of the rig file that is said at start
_WINDOW_OFF = 0xFFFFFFFF


@dataclass(frozen=True)
class _Reaction:
    """One object: its value from the rig, which values of a start-up object also brake, and what
    any other would let happen.
    """

    index: int
    kind: str
    value: int
    is_sound: Callable[[int], bool]
    otherwise: str


def _reactions(rig: Rig) -> tuple[_Reaction, ...]:
    options = drive_options(rig)
    lets_go = "takes the torque away while the motor moves"
    slowly = "brakes more softly than motor.stop_deceleration"
    return (
        _Reaction(
            ABORT_CONNECTION,
            "i16",
            options.lost_master,
            lambda value: value in (*_LETS_GO, options.lost_master),
            "does nothing, or nobody knows what, when the master is gone",
        ),
        _Reaction(
            QUICK_STOP,
            "i16",
            options.quick_stop,
            lambda value: value in _HOLDS,
            "lets go at the end of a quick stop, while the muscles still pull",
        ),
        _Reaction(SHUTDOWN, "i16", options.shutdown, lambda value: value == 1, lets_go),
        _Reaction(DISABLE, "i16", options.disable, lambda value: value == 1, lets_go),
        _Reaction(FAULT, "i16", options.fault, lambda value: value in (1, 2), lets_go),
        _Reaction(
            DECELERATION,
            "u32",
            options.deceleration_rpm_s,
            lambda value: value >= options.deceleration_rpm_s,
            slowly,
        ),
        _Reaction(
            QUICK_STOP_DECELERATION,
            "u32",
            options.quick_stop_rpm_s,
            lambda value: value >= options.quick_stop_rpm_s,
            slowly,
        ),
    )


def set_reactions(mailbox: Mailbox, slave: Slave, rig: Rig) -> list[str]:
    """Writes every reaction that the rig file's ``startup`` does not set itself, in PREOP.

    Raises BackendError where the drive does not keep a value, or where ``startup`` sets one that
    lets the motor fly at a stop. Gives notes: objects that the drive does not have, and whether it
    holds under power once its master is gone.
    """
    given, absent = _given(slave), []
    for reaction in _reactions(rig):
        index = reaction.index
        if index in given:
            if not reaction.is_sound(given[index]) and mailbox.number_if_there(index) is not None:
                raise BackendError(
                    f"found 0x{index:04X} = {given[index]} in the rig file's startup of"
                    f" {mailbox.label}, which {reaction.otherwise}, expected {reaction.value}:"
                    f" {startup_line(f'0x{index:04X}:00', reaction.kind, reaction.value)}, or leave"
                    " it out"
                )
        elif not mailbox.set_if_there(index, 0, _bytes_of(reaction)):
            absent.append(f"0x{index:04X}")
    if absent:
        return [
            f"{mailbox.label} does not tell what it does by itself at a stop (no"
            f" {', '.join(absent)}): pull its cable with the air off, and see"
        ]
    if given.get(ABORT_CONNECTION) in _LETS_GO:
        return [
            f"{mailbox.label} takes the torque away when its master is gone (0x6007 ="
            f" {given[ABORT_CONNECTION]} in the rig file's startup): a stretched muscle then throws"
            f" the motor; without that line it brakes and holds"
        ]
    ramp = given.get(QUICK_STOP_DECELERATION, drive_options(rig).quick_stop_rpm_s)
    return [
        f"{mailbox.label} brakes at {ramp} rpm/s when its master is gone and then holds under"
        " power, until the next master comes or its supply goes"
    ]


def set_window(mailbox: Mailbox, slave: Slave, rig: Rig) -> list[str]:
    """The drive's following-error window: ``WINDOW_SHARE`` times ``motor.following_error``, so that
    in position mode the rig's own limit is passed first. Without such a limit it is left alone.
    """
    error = rig.motor.following_error
    if error is None:
        return []
    per_count = abs(_scaling(rig).slope)
    counts = min(round(WINDOW_SHARE * error / per_count), _WINDOW_OFF - 1)
    given = _given(slave).get(FOLLOWING_ERROR_WINDOW)
    if given is not None:
        if given >= error / per_count:
            return []
        return [
            f"{mailbox.label} faults by itself at {given} counts of following error (0x6065 in the"
            f" rig file's startup), before motor.following_error of {error / per_count:.0f} counts"
        ]
    if mailbox.set_if_there(FOLLOWING_ERROR_WINDOW, 0, counts.to_bytes(4, "little")):
        return []
    return [f"{mailbox.label} does not tell its following-error window (0x6065)"]


def set_homing(mailbox: Mailbox, rig: Rig, homing: HomingOptions | None = None) -> list[str]:
    """Homing method and home position in counts. By default method 37: the drive's own homing mode
    then sets the position without moving.

    A method that moves gets its speeds and its acceleration first, and no move behind the pulse.
    Raises BackendError where the drive lacks an object of those.
    """
    options = homing or homing_here(rig)
    objects = [
        (HOMING_METHOD, 0, options.method.to_bytes(1, "little", signed=True)),
        (HOME_POSITION, 0, options.home_counts.to_bytes(4, "little", signed=True)),
    ]
    if options.moves:
        speed = options.speed_rpm.to_bytes(4, "little")
        objects = [
            (HOMING_SPEEDS, 1, speed),
            (HOMING_SPEEDS, 2, speed),
            (HOMING_ACCELERATION, 0, options.acceleration_rpm_s.to_bytes(4, "little")),
            (HOME_OFFSET_MOVE, 0, bytes(4)),
            *objects,
        ]
    absent = [
        f"0x{index:04X}"
        for index, subindex, data in objects
        if not mailbox.set_if_there(index, subindex, data)
    ]
    if absent and options.moves:
        raise BackendError(
            f"{mailbox.label} has no {', '.join(absent)}, which homing by index needs, expected"
            " another method in motor.zero of the rig file"
        )
    if options.moves:
        return [
            f"{mailbox.label} homes by method {options.method} at {options.speed_rpm} rpm and"
            f" {options.acceleration_rpm_s} rpm/s, read back"
        ]
    if absent:
        return [
            f"{mailbox.label} cannot be told its zero: it has no {', '.join(absent)}, which"
            " motor.zero in the rig file needs"
        ]
    return []


def _given(slave: Slave) -> dict[int, int]:
    """What the rig file's ``startup`` sets, by index."""
    return {sdo.place[0]: sdo.value for sdo in slave.startup if sdo.place[1] == 0}


def _bytes_of(reaction: _Reaction) -> bytes:
    return reaction.value.to_bytes(int(reaction.kind[1:]) // 8, "little", signed=True)


def _scaling(rig: Rig) -> Scaling:
    row = rig.row(rig.motor.position)
    return scaling_of(row, image_of(rig, outputs=False).places[row.entry].entry, rig)
