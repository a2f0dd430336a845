"""The conformance suite over the emulated bus in lock step; run by test_driver_conformance.py where it has a network."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/conformance"), str(Path(__file__).parent)]

import pytest  # noqa: E402
from backends import FACTORIES  # noqa: E402
from emulated import MASTER_END, emulated  # noqa: E402

from drivers.backend import EthercatBackend  # noqa: E402
from epa_rt.config.rig import Rig  # noqa: E402


class WithItsBus(EthercatBackend):
    """A backend that brings a fresh emulator along each time it is opened."""

    _beside = None

    def open(self) -> None:
        self._beside = emulated(self._rig, lock_step=True)
        self._beside.__enter__()
        super().open()

    def close(self) -> None:
        super().close()
        if self._beside is not None:
            self._beside.__exit__(None, None, None)
            self._beside = None


def over_the_bus(on: Rig, scenario: str) -> WithItsBus:
    return WithItsBus(on, MASTER_END, lock_step=True)


if __name__ == "__main__":
    FACTORIES["ethercat"] = over_the_bus
    sys.exit(pytest.main([str(ROOT / "tests/conformance"), "-q", "-k", "ethercat", "-p", "no:cacheprovider", "-W", "error"]))
