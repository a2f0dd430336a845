"""What a command under ``epa bus run`` finds of the bus beside it, in its environment."""

import argparse
import os
from collections.abc import Sequence
from typing import Any

INTERFACE, LOCK_STEP = "EPA_BUS_INTERFACE", "EPA_BUS_LOCK_STEP"


def interface_here() -> str | None:
    """The interface of the emulated bus; None where the command stands beside none."""
    return os.environ.get(INTERFACE) or None


def goes_in_lock_step() -> bool:
    """Whether the emulated bus beside the command waits for each frame."""
    return os.environ.get(LOCK_STEP) == "1"


class LockStep(argparse.Action):
    """--lock-step, refused where the emulated bus beside the command goes by the clock."""

    def __init__(self, option_strings: Sequence[str], dest: str, **options: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, default=goes_in_lock_step(), **options)

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        if os.environ.get(LOCK_STEP) == "0":
            parser.error(
                "found --lock-step beside an emulated bus that goes by the clock, expected it of"
                " both: epa bus run --lock-step hands it on"
            )
        setattr(namespace, self.dest, True)
