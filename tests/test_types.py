"""mypy in its strict mode has nothing to say of the packages that must not be wrong."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STRICT = ("drivers", "epa_rt.safety", "epa_rt.signals", "epa_rt.control", "epa_rt.loop")


def test_mypy_strict_has_nothing_to_say(tmp_path_factory):
    cache = tmp_path_factory.getbasetemp().parent / "mypy"  # kept from one session to the next
    packages = [word for package in STRICT for word in ("-p", package)]
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(cache), *packages],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert found.returncode == 0, found.stdout + found.stderr
