"""docs/notebook.ipynb runs from top to bottom, and says in words what its text promises."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import nbformat

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOK = ROOT / "docs/notebook.ipynb"


EXECUTE = """
import sys, nbformat
from nbclient import NotebookClient
source, folder, target = sys.argv[1:]
notebook = nbformat.read(source, as_version=4)
nbformat.validate(notebook)
where = {"metadata": {"path": folder}}
NotebookClient(notebook, timeout=300, kernel_name="python3", resources=where).execute()
nbformat.write(notebook, target)
"""
LONGEST_S = 400.0


def test_the_notebook_runs_and_shows_what_it_says(tmp_path):
    """In a process of its own: what Jupyter waits for cannot hold up the tests."""
    executed = tmp_path / "executed.ipynb"
    environment = os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR"):
        environment[name] = str(tmp_path / name.lower())
    words = [sys.executable, "-c", EXECUTE, NOTEBOOK, NOTEBOOK.parent, executed]
    with (tmp_path / "said").open("wb") as said_to:
        process = subprocess.Popen(
            words, env=environment, stdout=said_to, stderr=said_to, start_new_session=True
        )
        try:
            code = process.wait(LONGEST_S)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    assert code == 0, (tmp_path / "said").read_text(errors="replace")
    notebook = nbformat.read(executed, as_version=4)
    said = "".join(
        output.get("text", "") or output.get("data", {}).get("text/plain", "")
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
    )
    for words in (
        "completed",
        "3 trials",
        "A. Reader",
        "'muscle_force_n': 'N'",
        "another seed: None",
        "a leak: muscle_pressure_pa, drift in trial",
        "R2 0.9",
    ):
        assert words in said, said


def test_the_notebook_is_kept_without_results():
    """Results are made by running it; kept ones would grow old unseen."""
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        assert not cell.get("outputs") and cell.get("execution_count") is None
