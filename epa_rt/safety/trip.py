"""A trip: the cause that put the rig into its safe state, for log and screen."""

from typing import NamedTuple

OVER_RANGE_CAUSE = {
    "Pa": "over-pressure",
    "N": "over-force",
    "m": "over-travel",
    "rad": "over-travel",
    "A": "over-current",
    "m/s": "over-speed",
    "rad/s": "over-speed",
    "N*m": "over-torque",
}


class Trip(NamedTuple):
    """Why the envelope closed: cause (one of a few words), signal, a sentence, the cycle."""

    cause: str
    signal: str
    text: str
    cycle: int

    def __str__(self) -> str:
        return f"{self.cause}: {self.text}"
