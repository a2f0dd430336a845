"""scripts/env.sh: what it makes is its own, and what it did not make it leaves alone."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ENV = Path(__file__).parent.parent / "scripts" / "env.sh"


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize("name", ["pyvenv.cfg", "notes.txt"])
def test_an_environment_of_somebody_else_is_kept(tmp_path, name):
    """Somebody's own .venv, with what they installed into it, is not deleted."""
    kept = tmp_path / "theirs" / name
    kept.parent.mkdir()
    kept.write_text("mine")
    done = subprocess.run(
        ["bash", "-c", f"source '{ENV}'"],
        env=os.environ | {"EPA_VENV": str(kept.parent)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1 and kept.read_text() == "mine"
    assert "which this script did not make" in done.stderr
