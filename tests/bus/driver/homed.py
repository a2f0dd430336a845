"""Homing, jogging and their refusals on an emulated bus in lock step, as the command line does
them.
"""

import contextlib
import io
import tempfile
from pathlib import Path

from epa_rt.config.rig import load_rig
from epa_rt.config.zero_file import ZeroFile, write_zero, zero_path
from tests.bus.driver.emulated import MASTER_END, ROOT, Remote, emulated

HOLD = """
experiment: hold
loop: motor_speed
seed: 1
phases:
  - {name: out, move: {to: 12 mm, speed: 40 mm/s}}
"""


# the emulated motor starts at count 0, which is its true travel
AT_ZERO = {"method": "here", "at": "0 mm", "when": "2026-01-31T12:00:00Z", "end": 0}


def _copy(name: str, folder: Path) -> Path:
    text = (ROOT / f"config/rigs/{name}.yaml").read_text(encoding="utf-8")
    path = folder / f"{name}.yaml"
    path.write_text(text.replace("../plants/", f"{ROOT}/config/plants/"), encoding="utf-8")
    (folder / "hold.yaml").write_text(HOLD, encoding="utf-8")
    return path


def _epa(*words: object) -> tuple[int, str]:
    from epa_rt.cli.main import main

    said = io.StringIO()
    bus = ["--backend", "ethercat", "--interface", MASTER_END, "--lock-step", "--quiet"]
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main([*map(str, words), *bus])
    return code, said.getvalue()


def _supply_lost(bus) -> None:
    bus.plant.lose_drive_supply()


def _travel_m(bus) -> float:
    return float(bus.plant.state["truth"]["travel_m"][0])


def _verbs(remote: Remote, rig: Path, folder: Path) -> dict:
    """What each verb said; the plant's own travel where the homed runs ended."""
    run = ("run", folder / "hold.yaml", "--rig", rig, "-o", folder)
    return {
        "without": _epa(*run),
        "file": write_zero(zero_path(rig, emulated=True), ZeroFile(**AT_ZERO, rig=rig.stem)),
        "first": _epa(*run),
        "supply": remote.do(_supply_lost),
        "refused": _epa(*run),
        "jog": _epa("jog", "--rig", rig, "--move", "-5 mm", "-o", folder),
        "still": _epa(*run),
        "home": _epa("home", "--rig", rig, "--yes", "-o", folder),
        "again": _epa(*run),
        "travel_m": remote.do(_travel_m),
        "of_the_rig": zero_path(rig).exists(),
        "zero": (folder / f"{rig.stem}.emulated.zero.yaml").read_text(encoding="utf-8"),
    }


def lost_and_homed(rig: str) -> dict:
    """A run at 12 mm, the drive's supply lost, refused, jogged, refused, homed, and a run again."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        path = _copy(rig, folder)
        with emulated(load_rig(path), lock_step=True) as remote:
            return _verbs(remote, path, folder)
