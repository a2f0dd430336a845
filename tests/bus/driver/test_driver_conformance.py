"""The driver is held to the same protocol as every backend."""

import subprocess
import sys
from pathlib import Path

import pytest
from emulated import NAMESPACE, ROOT, need_namespace


@pytest.mark.timeout(300)
def test_the_conformance_suite_passes_over_the_emulated_bus():
    need_namespace()
    run = [*NAMESPACE, sys.executable, str(Path(__file__).with_name("conformance_run.py"))]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert done.stdout.count(".") >= 28  # seven tests on four rigs
