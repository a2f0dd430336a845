"""epa import --guess: the draft of a mapping, on the screen or in a file, and what is unsure."""

import os
import sys
import textwrap
from pathlib import Path
from typing import IO

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import written_to

_WIDTH = 79
_MOST_SAID = 40


def draft(files: list[Path], out: Path | None) -> int:
    """Writes the draft to ``out`` or prints it. Raises VerbError, ConfigError."""
    from epa_rt.logs.importers.guess.draft import guess
    from epa_rt.logs.importers.table import ImportRefused

    if out is not None and (out.suffix not in (".yaml", ".yml") or out.exists()):
        found = "a file" if out.exists() else "another ending"
        raise VerbError(f"{out}: found {found}, expected a free name that ends in .yaml")
    try:
        found = guess(files)
    except ImportRefused as error:
        raise VerbError(" ".join(str(error).split())) from None
    text = found.text.encode("utf-8", "replace").decode()
    if out is None:
        print(text, end="")
        names = " ".join(str(path) for path in files)
        said = [f"unsure: {doubt}" for doubt in found.unsure] + list(found.says)
        said.append(f"next: epa import --guess {names} -o MAPPING.yaml keeps the draft in a file")
        print(_wrapped(said), file=sys.stderr)
        return COMPLETED
    _write(out, text)
    signals = f"{len(found.rows)} signal{'s' * (len(found.rows) != 1)}"
    print(filled(f"mapping: {out} ({found.survey.kind}, {signals}, {len(found.unsure)} unsure)"))
    print(_wrapped([f"unsure: {doubt}" for doubt in found.unsure] + list(found.says)))
    print(filled(f"tried: {_tried(out, files)}"))
    names = " ".join(str(path) for path in files)
    print(filled(f"next: correct it, then epa import {out} {names} --dry"))
    return COMPLETED


def _write(out: Path, text: str) -> None:
    from epa_rt.runs.new_file import write_new

    with written_to(out):
        try:
            write_new(out, lambda file: _all(file, text))
        except FileExistsError:
            if not os.path.lexists(out):
                raise  # it is a folder of its path that is a file
            raise VerbError(f"{out}: found a file, expected a name that is free") from None


def _all(file: IO[bytes], text: str) -> None:
    file.write(text.encode())


def _wrapped(sentences: list[str]) -> str:
    rest = len(sentences) - _MOST_SAID
    shown = sentences[:_MOST_SAID] + ([f"and {rest} more"] if rest > 0 else [])
    return "\n".join(
        textwrap.fill(one, _WIDTH, initial_indent="  ", subsequent_indent="    ") for one in shown
    )


def _tried(out: Path, files: list[Path]) -> str:
    """What an import by the draft as it stands would find."""
    from epa_rt.config.source import ConfigError
    from epa_rt.logs.importers.gather import gather
    from epa_rt.logs.importers.mapping import load_mapping
    from epa_rt.logs.importers.table import ImportRefused

    try:
        mapping, located = load_mapping(out)
        gathered = gather(mapping, located, files)
    except (ConfigError, ImportRefused) as error:
        return f"as it stands it is refused: {error}"
    grid, count = gathered.grid, sum(trial.judged for trial in gathered.trials)
    return (
        f"{len(grid.cycle)} rows, {grid.t_s[-1]:.6g} s, a period of {grid.period_s * 1e3:.6g} ms,"
        f" {count} trial{'s' * (count != 1)}"
    )
