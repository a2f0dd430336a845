"""Pages of studies, and their pictures as files."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from epa_rt.report.charts import Figure, embed
from epa_rt.report.markup import Html, esc, join, note, paragraph, table, tag
from epa_rt.report.page import page
from epa_rt.report.sections.section import Section
from epa_rt.study.claims import Claim

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PICTURE_WIDTH_PX = 760


class PictureError(Exception):
    """One sentence: why there are no picture files."""


def study_page(
    title: str,
    lead: Sequence[str],
    figures: Mapping[str, Figure],
    claims: Sequence[Claim],
    more: Sequence[Section] = (),
    drawing: Html | None = None,
) -> str:
    """A self-contained page: lead, ``drawing``, one section per figure (its key is its title),
    further sections, claims.
    """
    head = join([tag("h1", title), *(paragraph(one) for one in lead), drawing or Html("")])
    sections = [
        Section(f"picture{i}", name, embed(figure))
        for i, (name, figure) in enumerate(figures.items())
    ]
    judged = [Section("claims", "Claims of the paper", claims_table(claims))] if claims else []
    return page(title, head, [*sections, *more, *judged])


def claims_table(claims: Sequence[Claim]) -> Html:
    rows = [(c.where, c.claim, c.ours, c.verdict, c.why) for c in claims]
    return table(
        ("where", "claim", "found here", "verdict", "why"), rows, text_columns=(0, 1, 2, 3, 4)
    )


def list_table(head: Sequence[str], rows: Sequence[Sequence[object]], said: str) -> Html:
    return join([table(head, rows), note(said)])


def write_pictures(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Each figure as a PNG named by its key, drawn by a browser without a screen. Raises
    PictureError where there is none.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise PictureError("--pictures: found no browser, expected one of " + ", ".join(BROWSERS))
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in figures.items():
        path = folder / f"{name}.png"
        _draw(browser, name, figure, path)
        written.append(path)
    return written


def _draw(browser: str, name: str, figure: Figure, path: Path) -> None:
    text = page(name, esc(""), [Section("picture", "", embed(figure))])
    bare = (
        "<style>h2, nav, header, figcaption {display: none} body, main, section, figure {margin: 0;"
        " padding: 0; border: 0; max-width: none}</style></head>"
    )
    with tempfile.TemporaryDirectory() as place:
        source = Path(place) / "picture.html"
        source.write_text(text.replace("</head>", bare, 1), encoding="utf-8")
        command = [
            browser,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            f"--user-data-dir={place}/profile",
            "--force-device-scale-factor=2",
            f"--window-size={PICTURE_WIDTH_PX},{figure.height + 8}",
            f"--screenshot={path.resolve()}",
            "--virtual-time-budget=8000",
            source.as_uri(),
        ]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=120,
                env={**os.environ, "HOME": place},
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise PictureError(f"{path}: cannot be drawn ({type(error).__name__})") from None
    if done.returncode != 0 or not path.exists():
        raise PictureError(
            f"{path}: cannot be drawn"
            f" ({(done.stderr.strip().splitlines() or ['no picture'])[-1][:120]})"
        )
