"""The conformance suite over the emulated bus in lock step; run by test_driver_conformance.py where
it has a network.
"""

import contextlib
import io
import sys
from pathlib import Path

from drivers.backend import EthercatBackend
from epa_rt.config.rig import Rig
from tests.bus.driver.emulated import MASTER_END, ROOT, emulated


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


def run_suite() -> dict:
    """Exit code and report of the whole suite with this backend alone."""
    import pytest

    folder = ROOT / "tests/conformance"
    sys.path.insert(0, str(folder))
    from backends import FACTORIES

    FACTORIES["ethercat"] = over_the_bus
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        code = pytest.main(
            [
                str(Path(folder)),
                "-k",
                "ethercat",
                "-p",
                "no:cacheprovider",
                "-p",
                "no:xdist",
                "-W",
                "error",
            ]
        )
    return {"code": int(code), "said": said.getvalue()}
