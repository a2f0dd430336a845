"""What the tasks of epa study share: where a grid runs, where its results are kept, what it
writes.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.outputs import add_html_argument, add_json_argument

if TYPE_CHECKING:
    from epa_rt.report.charts import Figure
    from epa_rt.study.grid import How


def _jobs(text: str) -> int:
    value = int(text)
    if value == 0 or not -1 <= value <= 4096:
        raise argparse.ArgumentTypeError(
            f"found {text}, expected a number of jobs from 1, or -1 for all cores"
        )
    return value


def add_grid_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "study", type=Path, metavar="STUDY.yaml", help="study file (config/studies/*.yaml)"
    )
    parser.add_argument(
        "--store",
        type=Path,
        default=Path("out/study"),
        metavar="FOLDER",
        help="results are kept here and not computed again (default: %(default)s)",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=_jobs, default=-1, help="how many at a time (default: all cores)"
    )
    where.add_argument(
        "--cluster",
        metavar="tcp://HOST:PORT",
        help="run on the Dask cluster whose scheduler is there",
    )
    add_html_argument(parser, "write a page with pictures")
    add_json_argument(parser, "all figures for machines")
    parser.add_argument(
        "--pictures",
        type=Path,
        metavar="FOLDER",
        help="write the pictures as PNG files (needs chromium)",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress")


def check_grid_arguments(arguments: argparse.Namespace) -> None:
    """Raises VerbError before any work where a file could not be written in the end."""
    from epa_rt.cli.write import check_writable

    check_writable(arguments.json, (".json",))
    check_writable(arguments.html, (".html", ".htm"))
    for folder in (arguments.store, arguments.pictures):
        if folder is not None and folder.exists() and not folder.is_dir():
            raise VerbError(f"{folder}: found a file, expected a folder")


def how(arguments: argparse.Namespace, threads: bool = True) -> "How":
    from epa_rt.study.grid import How

    return How(arguments.jobs, arguments.cluster, threads)


@contextmanager
def grid_progress(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Progress of a grid; what stops the grid becomes one sentence to the operator. Raises
    VerbError.
    """
    from epa_rt.cli.progress import progress_shown
    from epa_rt.study.grid import GridError

    try:
        with progress_shown(quiet) as progress:
            yield progress
    except GridError as error:
        raise VerbError(str(error)) from None


def write_answers(
    arguments: argparse.Namespace,
    answer: dict[str, Any],
    page: str | None,
    figures: "dict[str, Figure]",
) -> list[Path]:
    """Writes what was asked for; the files that came of it."""
    from epa_rt.cli.write import write_whole, written_to
    from epa_rt.gap.report.as_json import finite
    from epa_rt.study.report.page import PictureError, write_pictures

    written = []
    if arguments.json:
        write_whole(
            arguments.json,
            json.dumps(finite(answer), indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        )
        written.append(arguments.json)
    if arguments.html and page:
        write_whole(arguments.html, page)
        written.append(arguments.html)
    if arguments.pictures:
        try:
            with written_to(arguments.pictures / "*.png"):
                written += write_pictures(arguments.pictures, figures)
        except PictureError as error:
            raise VerbError(str(error), FAILED) from None
    return written
