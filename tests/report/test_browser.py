"""The page in a real browser: every picture is drawn, and nothing complains."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from epa_rt.report.charts import Line, Panel, embed, stack
from epa_rt.report.markup import Html, table
from epa_rt.report.page import page, run_page
from epa_rt.report.run import Run, load_run
from epa_rt.report.sections.section import Section

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


NARROW_PX = 500  # a window beside another, or a tablet held upright
PROBE = """<script>addEventListener("load", () => setTimeout(() => {
  const width = document.documentElement.clientWidth, beyond = [];
  const reach = (one, what) => {
    const right = one.getBoundingClientRect().right;
    if (right > width + 1) beyond.push(what + one.textContent.slice(0, 40));
  };
  for (const one of document.querySelectorAll(".chart svg text")) reach(one, "in a picture: ");
  for (const one of document.querySelectorAll("body *"))
    if (!one.closest(".wide, pre, svg, .chart")) reach(one, one.tagName + ": ");
  document.body.dataset.beyond = JSON.stringify(beyond);
}, 1000));</script></body>"""  # fmt: skip


def opened(page: Path, folder: Path, width_px: int = 1200) -> subprocess.CompletedProcess:
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
        f"--window-size={width_px},6000",
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
    file = tmp_path / "page.html"
    file.write_text(run_page(run, 1.03), encoding="utf-8")
    asked = len(re.findall(r'<div class="chart"', file.read_text()))
    done = opened(file, tmp_path)
    drawn = [part for part in done.stdout.split('class="chart')[1:] if "main-svg" in part]
    assert len(drawn) == asked >= 5
    assert len(re.findall(r'class="main-svg"', done.stdout)) >= asked
    assert "CONSOLE" not in done.stderr


def beyond_the_window(text: str, folder: Path) -> list[str]:
    """What of a page's text and pictures a window of NARROW_PX cuts; tables may be scrolled."""
    file = folder / "page.html"
    file.write_text(text.replace("</body>", PROBE), encoding="utf-8")
    said = re.search(r'data-beyond="([^"]*)"', opened(file, folder, NARROW_PX).stdout)
    assert said is not None, "the page's scripts did not run to their end"
    return json.loads(html.unescape(said.group(1)))


@pytest.mark.slow
def test_a_narrow_window_cuts_nothing_of_a_run(
    request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run: Run = load_run(request.getfixturevalue("knee_log"))
    assert beyond_the_window(run_page(run, 1.03), tmp_path) == []


def test_names_of_lines_break_where_a_narrow_window_would_cut_them(tmp_path: Path) -> None:
    x = np.arange(10.0)
    names = ("serial", "both", "parallel", "antagonistic", "measured on the rig", "as believed")
    lines = [Line(x, x + k, name) for k, name in enumerate(names)]
    panels = [Panel(f"least peak of force times speed {k}", "W", lines) for k in range(2)]
    wide = table([f"column {k}" for k in range(30)], [["1.000 mm"] * 30])
    sections = [Section("one", "One", embed(stack(panels))), Section("two", "Two", wide)]
    text = page("Names", Html("<h1>" + "a_name_without_a_blank" * 6 + "</h1>"), sections)
    assert beyond_the_window(text, tmp_path) == []
