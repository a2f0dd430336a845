"""Draws docs/pictures/live-view.svg and live-trip.svg: the terminal view of simulated runs.

The view is the real one at 80 x 24, attached to a run of its own that goes at twice real time;
the second one has a low limit of force, and trips.

    python scripts/live_picture.py --out docs/pictures
"""

import argparse
import asyncio
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from epa_rt.live.attach import Attached, NotOn, find
from epa_rt.live.terminal import LiveView
from epa_rt.live.watched import WatchedRun

SIZE, SPEED = (80, 24), 2
_FACES = re.compile(r"@font-face \{.*?\}\s*", re.DOTALL)  # fonts of another server's


def picture(log: Path, due: Callable[[WatchedRun], bool], marks: bool) -> str:
    """The view of a run that is on, as SVG, once `due` holds of it."""

    async def drive() -> str:
        with Attached(_soon(log)) as attached:
            view = LiveView(attached)
            async with view.run_test(size=SIZE) as pilot:
                while not due(view.run_seen):
                    await pilot.pause(0.02)
                if marks:
                    await pilot.press("m")
                    await pilot.pause(0.5)
                view.clear_notifications()
                view.show()
                await pilot.pause()
                return view.export_screenshot(title="epa run --live", simplify=True)

    text = _FACES.sub("", asyncio.run(drive()))
    return re.sub(
        r"font-family: Fira Code[^;]*;", "font-family: DejaVu Sans Mono, monospace;", text
    )


def _soon(log: Path) -> Path:
    end_s = time.monotonic() + 300.0  # the plant may have to be compiled first
    while True:
        try:
            return find(log)
        except NotOn:
            if time.monotonic() > end_s:
                raise
        time.sleep(0.05)


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--out", type=Path, default=ROOT / "docs/pictures")
    out = arguments.parse_args().out
    cases: tuple[tuple[str, str, str, Callable[[WatchedRun], bool], bool], ...] = (
        ("live-view", "knee_chirp_short", "knee", lambda run: run.t_s > 16.0, True),
        ("live-trip", "identification_short", "bench", lambda run: bool(run.outcome), False),
    )
    for name, experiment, rig, due, marks in cases:
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "run.mcap"
            command = [sys.executable, "-m", "epa_rt", "run"]
            command += [str(ROOT / f"config/experiments/{experiment}.yaml")]
            command += ["--rig", str(_rig(rig, Path(folder))), "--quiet", "-o", str(log)]
            run = subprocess.Popen(
                [*command, "--speed", str(SPEED)], cwd=ROOT, stdout=subprocess.DEVNULL
            )
            try:
                text = picture(log, due, marks)
            finally:
                run.terminate()
                run.wait()
        (out / f"{name}.svg").write_text(text, encoding="utf-8")
        print(out / f"{name}.svg")


def _rig(name: str, folder: Path) -> Path:
    """A delivered rig; the bench with a limit of force that is low enough to be reached."""
    text = (ROOT / f"config/rigs/{name}.yaml").read_text(encoding="utf-8")
    if name == "bench":
        text = text.replace("limits: [-40 N, 350 N]", "limits: [-40 N, 120 N]")
    path = folder / f"{name}.yaml"
    path.write_text(text.replace("plant: ../", f"plant: {ROOT}/config/"), encoding="utf-8")
    return path


if __name__ == "__main__":
    main()
