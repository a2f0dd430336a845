"""A delivered rig file at another period, beside copies of the plants it may name."""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def rig_at_period(name: str, period_ms: float, folder: Path) -> Path:
    """Writes ``folder/rigs/NAME.yaml``: only the period, and what counts as late within it,
    differ.
    """
    shutil.copytree(ROOT / "config/plants", folder / "plants", dirs_exist_ok=True)
    text = (ROOT / f"config/rigs/{name}.yaml").read_text(encoding="utf-8")
    for old, new in (
        ("period: 1 ms", f"period: {period_ms:g} ms"),
        ("late: 0.3 ms", f"late: {0.3 * period_ms:g} ms"),
    ):
        assert old in text, f"{name}.yaml no longer has {old!r}"
        text = text.replace(old, new, 1)
    path = folder / "rigs" / f"{name}.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path
