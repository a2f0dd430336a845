"""Logs of the simulated rigs for the tests of gap/house: one run of the real loop each, kept for
the session.
"""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house import HouseSubject, open_house
from epa_rt.gap.rig.read import read_recording

ROOT = Path(__file__).resolve().parents[3]
EXPERIMENTS = {
    "bench": "identification_short",
    "bench_analog": "identification_short",
    "knee": "knee_chirp_short",
}


@cache
def _folder() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="epa-house-")


def plant_of(rig: str) -> Path:
    return ROOT / "config/plants" / f"{rig.removesuffix('_analog')}.yaml"


@cache
def subject(rig: str) -> HouseSubject:
    return open_house(ROOT / "config/rigs" / f"{rig}.yaml", plant_of(rig))


def recorded(rig: str, seed: int, plant: Path | None = None) -> Recording:
    """A run of the loop on the simulated rig, read back."""
    return _recorded(rig, seed, plant or plant_of(rig))


@cache
def _recorded(rig: str, seed: int, plant: Path) -> Recording:
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.cli.run import run_simulated

    out = Path(_folder().name) / f"{rig}-{plant.stem}-{seed}.mcap"
    inputs = load_inputs(
        ROOT / "config/experiments" / f"{EXPERIMENTS[rig]}.yaml",
        ROOT / "config/rigs" / f"{rig}.yaml",
        plant,
        with_plant=True,
    )
    run_simulated(inputs, out, seed, None, progress=False)
    return read_recording(out)


def plant_with(rig: str, name: str, **values: float) -> Path:
    """A plant file beside the rig's own, with other numbers; keys as block__row."""
    path = Path(_folder().name) / f"{name}.yaml"
    path.write_text(
        subject(rig).patched({key.replace("__", "."): value for key, value in values.items()}, ()),
        encoding="utf-8",
    )
    return path


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
