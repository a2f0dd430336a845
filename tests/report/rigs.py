"""A rig like the delivered bench, on which the identification run trips."""

from pathlib import Path

from tests.cli.shell import RIGS, ROOT


def rig_that_trips(folder: Path) -> Path:
    """The bench with a force limit of 60 N, beside its plant."""
    text = (RIGS / "bench.yaml").read_text()
    limited = text.replace("limits: [-40 N, 350 N]", "limits: [-40 N, 60 N]")
    assert limited != text
    (folder / "rigs").mkdir()
    (folder / "plants").mkdir()
    (folder / "plants" / "bench.yaml").write_bytes((ROOT / "config/plants/bench.yaml").read_bytes())
    path = folder / "rigs" / "bench.yaml"
    path.write_text(limited)
    return path
