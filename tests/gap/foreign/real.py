"""Recordings of others as the diagnosis reads them: brought in by epa import's own code, read by
gap's own reader.
"""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DATA, RIGS, IMPORTS = (
    ROOT.parent / "shared/data",
    ROOT / "config/rigs_foreign",
    ROOT / "config/imports",
)


def recording(folder: Path, mapping: str, *names: str):
    """A recording of ``DATA`` by one of our mappings; skips the test where it is not beside the
    checkout.
    """
    from epa_rt.gap.rig.read import read_recording
    from epa_rt.logs.importers.log_of import log_of

    files = [DATA / name for name in names]
    if not all(path.exists() for path in files):
        pytest.skip(f"the recording {names[0]} is not beside the checkout (../shared/data)")
    stem = (
        files[0].stem if files[0].stem not in ("control", "state_motor") else files[0].parent.name
    )
    log = folder / f"{stem}.mcap"
    if not log.exists():
        log_of(IMPORTS / f"{mapping}.yaml", files, log)
    return read_recording(log)


def families(diagnosis) -> list[str]:
    return [effect.family for effect in diagnosis.effects]
