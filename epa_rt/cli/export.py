"""Write a log as a table for other programs: CSV, Parquet or MAT.

The ending of the name says which. One row for each cycle, SI units, names
that end in their unit; state, phase and trial (from 1) stand in each row.
Numbers keep their last bit. Parquet and MAT carry units, trials, events and
who ran; beside a CSV file these lie in NAME.about.json. No file is written
over without --force.

  epa export out/knee_chirp-knee-001.mcap -o run.parquet
  epa export out/identification_short-bench-001.mcap -o trial.csv --trial 2 \\
      --signals 'muscle_*'
  epa export out/knee_chirp-knee-001.mcap -o run.mat --force
"""

import argparse
import os
from pathlib import Path
from typing import IO, TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError

if TYPE_CHECKING:
    from collections.abc import Callable

    from epa_rt.report.run import Run


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("log", type=Path, metavar="LOG", help="log of a run (*.mcap)")
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        required=True,
        metavar="FILE",
        help="what to write: .csv, .parquet or .mat",
    )
    verb.add_argument(
        "--signals",
        nargs="+",
        default=(),
        metavar="SIGNAL",
        help="names or patterns with * and ? (default: all)",
    )
    verb.add_argument("--trial", type=int, metavar="N", help="this trial alone, counted from 1")
    verb.add_argument("--force", action="store_true", help="write over a file that is there")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.write import check_writable
    from epa_rt.logs.reader import LogError
    from epa_rt.report.run import NotShown, load_run
    from epa_rt.runs.export import WRITERS, ExportError, about_text
    from epa_rt.runs.table import table_of

    out = arguments.out
    check_writable(out, tuple(WRITERS))
    paths = [out, about_path(out)] if out.suffix.lower() == ".csv" else [out]
    for path in paths:
        if os.path.lexists(path) and not arguments.force:
            raise _there(path)
    try:
        run = load_run(arguments.log)
        table = table_of(run, samples_of(run, arguments.trial), tuple(arguments.signals))
        write = WRITERS[out.suffix.lower()]
        _write(out, lambda file: write(table, file), arguments.force)
        if len(paths) > 1:
            text = about_text(table).encode("utf-8", "replace")
            try:
                _write(paths[1], lambda file: _all(file, text), arguments.force)
            except BaseException:
                out.unlink(missing_ok=True)  # numbers without their units are half an answer
                raise
    except LogError as error:
        raise VerbError(str(error)) from None
    except NotShown as error:
        raise VerbError(f"{arguments.log}: {error}") from None
    except ExportError as error:
        raise VerbError(f"{out}: {error}") from None
    for sentence in run.missing:
        print(f"the log is not whole: {sentence}")
    print(f"{out} ({table.rows} rows, {len(table.columns)} columns)")
    return COMPLETED


def about_path(out: Path) -> Path:
    """``run.about.json`` beside ``run.csv``."""
    return out.with_suffix(".about.json")


def samples_of(run: "Run", trial: int | None) -> slice:
    """The samples of a trial, counted from 1; all without one. Raises NotShown where there is no
    such trial.
    """
    from epa_rt.report.run import NotShown
    from epa_rt.runs.table import trials_of

    if trial is None:
        return slice(None)
    trials = trials_of(run)
    if not 1 <= trial <= len(trials):
        raise NotShown(f"found no trial {trial}, expected 1 to {len(trials)}")
    return trials[trial - 1].samples


def _write(path: Path, write: "Callable[[IO[bytes]], None]", replace: bool) -> None:
    from epa_rt.cli.write import cannot_write
    from epa_rt.runs.new_file import write_new

    try:
        write_new(path, write, replace)
    except FileExistsError as error:
        raise (_there(path) if os.path.lexists(path) else cannot_write(path, error)) from None
    except OSError as error:
        raise cannot_write(path, error) from None


def _there(path: Path) -> VerbError:
    return VerbError(f"{path}: found a file, expected a name that is free, or --force")


def _all(file: IO[bytes], text: bytes) -> None:
    file.write(text)
