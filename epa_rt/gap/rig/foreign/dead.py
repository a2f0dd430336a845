"""Channels of a component rig that say one and the same thing while the others move: what is asked
of its drive, and what its model has to foresee.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import Finding, judged_rows, measured_names
from epa_rt.gap.hygiene.values import invalid
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.rig_file import ForeignRig

_PLACES, _EFFORTS = ("m", "rad"), ("N", "N*m")  # units of positions, and of forces and torques


def check_dead(
    recordings: Sequence[Recording], rig: ForeignRig, scaled: bool = False
) -> list[Finding]:
    """What is asked of a drive and has no value, and notes where it never changes while another
    channel does: a shaft that runs down without a drive is a good log beside others.

    An output that a sensor makes and that never changes while what it is foreseen from does cannot
    be judged: refused where no recording has another, else left out. An output of 0 in all of them
    is refused, whoever says it: any part of inertia and friction balances to it. ``scaled``: the
    plant file has effects, whose known size says which part.
    """
    outputs = [_Output(recordings, rig, role) for _, role in rig.component.links]
    return [
        *(one for recording in recordings for one in _asked(recording, rig)),
        *(one for output in outputs for one in output.findings(scaled)),
    ]


def _asked(recording: Recording, rig: ForeignRig) -> list[Finding]:
    found = []
    names = [name for name in rig.channels.values() if name in recording.columns]
    moving = [name for name in names if _moves(recording.columns[name])]
    measured = measured_names(recording)
    for name in (name for name in names if name not in measured):
        found += invalid(recording, name, recording.columns[name], judged_rows(recording))
        if name not in moving and moving and np.isfinite(recording.columns[name]).any():
            says = (
                f"{_one_value(recording, name, moving)}: it is dead, or this log is of a run"
                " without its drive"
            )
            found.append(_of(recording, name, "note", says))
    return found


class _Output:
    """A link's measured output in all recordings."""

    def __init__(self, recordings: Sequence[Recording], rig: ForeignRig, role: str) -> None:
        self._name = rig.channels[role]
        self._unit = next(one.unit for one in rig.component.channels if one.role == role)
        self._inputs = [
            rig.channels[one]
            for one in rig.component.needs.get(role, ())
            if rig.channels[one] != self._name
        ]
        self._with = [
            one for one in recordings if np.isfinite(one.columns.get(self._name, np.zeros(0))).any()
        ]
        self._still = [one for one in self._with if not _moves(one.columns[self._name])]

    def findings(self, scaled: bool) -> list[Finding]:
        """On the recordings in which it never changes while what it is foreseen from does."""
        dead = [(one, moving) for one in self._still if (moving := self._moving(one)) is not None]
        if not dead:
            return []
        if len(self._still) < len(self._with):
            return [self._left_out(one, moving) for one, moving in dead if self._is_read(one)]
        zero = not scaled and all(_value(one, self._name) == 0.0 for one in self._with)
        return [self._refused(one, moving) for one, moving in dead if self._is_read(one)] or [
            self._without_scale(one, moving) for one, moving in dead if zero
        ]

    def _moving(self, recording: Recording) -> list[str] | None:
        """The inputs that move; None where none does, though there are some: the rig rests."""
        moving = [
            name
            for name in self._inputs
            if name in recording.columns and _moves(recording.columns[name])
        ]
        return moving if moving or not self._inputs else None

    def _is_read(self, recording: Recording) -> bool:
        return self._name in measured_names(recording)

    def _left_out(self, recording: Recording, moving: list[str]) -> Finding:
        says = _one_value(recording, self._name, moving)
        if self._unit in _PLACES:  # friction or play may hold it in one log
            return _of(recording, self._name, "note", says)
        rows = ((0, recording.samples),)
        says += f": it is dead, and left out{self._or_asked()}"
        return _of(recording, self._name, "exclude", says, rows)

    def _refused(self, recording: Recording, moving: list[str]) -> Finding:
        says = _one_value(recording, self._name, moving)
        says += f": it is dead, and nothing can be judged by it{self._or_asked()}"
        return _of(recording, self._name, "refuse", says)

    def _or_asked(self) -> str:
        """A force may be one value in earnest where it is no reading."""
        return (
            " (what a drive is asked for has a name with cmd_ in front)"
            if self._unit in _EFFORTS
            else ""
        )

    def _without_scale(self, recording: Recording, moving: list[str]) -> Finding:
        says = (
            f"{recording.name}: {self._name}: found 0 on every row while {moving[0]} moves,"
            " expected a log with the drive as well: any part of inertia and friction balances to"
            " 0"
        )
        return _of(recording, self._name, "refuse", says)


def _one_value(recording: Recording, name: str, moving: list[str]) -> str:
    also = f" while {moving[0]} moves" if moving else ""
    return (
        f"{recording.name}: {name}: found {_value(recording, name):.6g} on every row{also},"
        f" expected a channel that moves{' too' if moving else ''}"
    )


def _of(recording: Recording, name: str, severity: str, says: str, rows: tuple = ()) -> Finding:
    return Finding(severity, "dropped channel", recording.name, name, says, rows)


def _value(recording: Recording, name: str) -> float:
    return float(np.nanmin(recording.columns[name]))


def _moves(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.ptp(known) > 0.0)
