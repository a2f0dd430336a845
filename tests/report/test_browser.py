"""The page in a real browser: every picture is drawn, and nothing complains."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from epa_rt.report.page import run_page
from epa_rt.report.run import Run, load_run

CHROMIUM = next(
    (
        found
        for name in ("chromium", "chromium-browser", "google-chrome")
        if (found := shutil.which(name))
    ),
    None,
)

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium on this machine: the Debian package chromium has it"
)


def opened(page: Path, folder: Path) -> subprocess.CompletedProcess:
    """The page as the browser has it after its scripts ran, and on stderr what its console said."""
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
        f"--user-data-dir={folder / 'profile'}",
        "--window-size=1200,6000",
        "--virtual-time-budget=8000",
        "--enable-logging=stderr",
        "--dump-dom",
        page.as_uri(),
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)


@pytest.mark.parametrize("which", ["bench", "tripped", "knee"])
def test_every_picture_is_drawn_and_the_console_stays_silent(
    which: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run: Run = load_run(request.getfixturevalue(f"{which}_log"))
    page = tmp_path / "page.html"
    page.write_text(run_page(run, 1.03), encoding="utf-8")
    asked = len(re.findall(r'<div class="chart"', page.read_text()))
    done = opened(page, tmp_path)
    drawn = [part for part in done.stdout.split('class="chart')[1:] if "main-svg" in part]
    assert len(drawn) == asked >= 5
    assert len(re.findall(r'class="main-svg"', done.stdout)) >= asked
    assert "CONSOLE" not in done.stderr
