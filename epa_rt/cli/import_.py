"""Turn a recording of somebody else into a log, by a mapping file; --guess drafts it.

Read are CSV, MAT, MCAP, ROS 2 bags, Parquet, JSON lines and NPZ. The mapping says
which column is which signal, in which unit, and when each row was. Whatever does
not fit is refused with file, line and column, and nothing is written. Resampling
and lost rows are counted and said.

  epa import --guess run.csv -o mapping.yaml                       a draft to read and correct
  epa import config/imports/emps.yaml DATA_EMPS.mat --dry          what would be read
  epa import config/imports/emps.yaml DATA_EMPS.mat -o out/emps.mcap
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import written_to

if TYPE_CHECKING:
    from epa_rt.config.source import Located
    from epa_rt.logs.importers.gather import Gathered
    from epa_rt.logs.importers.mapping import Mapping


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "mapping",
        type=Path,
        metavar="MAPPING",
        help="mapping file (config/imports/*.yaml; docs/import.md); left out with --guess",
    )
    verb.add_argument(
        "files",
        nargs="*",
        type=Path,
        metavar="FILE",
        help="what was recorded: one file or a bag's folder, or the files of one recording",
    )
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="LOG.mcap",
        help="log to write (a name that is free); with --guess the mapping, NAME.yaml",
    )
    verb.add_argument(
        "--guess",
        action="store_true",
        help="draft the mapping of FILE, and say what is unsure (without -o: on the screen)",
    )
    verb.add_argument(
        "--dry",
        action="store_true",
        help="read and check everything, show what would be in the log, write nothing",
    )


def main(arguments: argparse.Namespace) -> int:
    if arguments.guess:
        from epa_rt.cli.import_guess import draft

        return draft([arguments.mapping, *arguments.files], arguments.out)
    return _import(arguments)


def _import(arguments: argparse.Namespace) -> int:
    from epa_rt.logs.importers.gather import gather
    from epa_rt.logs.importers.mapping import load_mapping
    from epa_rt.logs.importers.table import ImportRefused
    from epa_rt.logs.importers.write import attachments_of, write_log

    out = arguments.out
    if not arguments.files:
        raise VerbError(
            f"found {arguments.mapping} alone, expected a mapping and what was recorded (a mapping"
            " is drafted by: epa import --guess FILE -o MAPPING.yaml)"
        )
    if not arguments.dry and (out is None or out.suffix != ".mcap"):
        raise VerbError(
            f"found {'no log to write' if out is None else out}, expected -o with a name that ends"
            " in .mcap, or --dry"
        )
    mapping, located = load_mapping(arguments.mapping)
    _check_kind(mapping, located)
    try:
        gathered = gather(mapping, located, arguments.files)
        attachments = attachments_of(mapping, located, arguments.files)
        if not arguments.dry:
            with written_to(out):  # before a word is printed: whoever reads it may hang up
                write_log(out, mapping, gathered, attachments, arguments.files)
        print(filled(table_text(mapping, gathered)))
        if not arguments.dry:
            print(filled(f"log: {out} ({out.stat().st_size / 1e6:.1f} MB)"))
    except ImportRefused as error:
        raise VerbError(str(error)) from None
    return COMPLETED


def _check_kind(mapping: "Mapping", located: "Located") -> None:
    """Raises ConfigError where a rig of others says no atmosphere and its kind takes another one
    than the mapping says.
    """
    from epa_rt.config.source import load_yaml
    from epa_rt.gap.rig.foreign.kinds import KINDS
    from epa_rt.logs.importers.rig_text import SAME_ATMOSPHERE

    if mapping.rig_file is None or located.data.get("atmosphere") is None:
        return
    rig = load_yaml(located.path.parent / mapping.rig_file).data
    kind, settings = KINDS.get(str(rig.get("kind"))), rig.get("settings")
    if kind is None or isinstance(settings, dict) and "atmosphere" in settings:
        return
    taken = next(
        (setting.default for setting in kind.settings if setting.name == "atmosphere"), None
    )
    if taken is not None and abs(taken / mapping.atmosphere - 1.0) > SAME_ATMOSPHERE:
        raise located.error(
            ("atmosphere",),
            f"{mapping.atmosphere / 1e3:.6g} kPa abs",
            f"{taken / 1e3:.6g} kPa abs, which a {rig['kind']} takes where its rig file"
            f" {mapping.rig_file} does not say 'settings: {{atmosphere: ...}}'",
        )


def table_text(mapping: "Mapping", gathered: "Gathered") -> str:
    """What a log would hold: grid, signals with their range, trials, and what was done on the
    way.
    """
    import numpy as np

    from epa_rt.config.rig_rows import si_unit_of

    grid = gathered.grid
    lines = [
        f"rig {mapping.rig}: {len(grid.cycle)} rows, {grid.t_s[-1]:.6g} s, a period of"
        f" {grid.period_s * 1e3:.6g} ms"
    ]
    for kind, columns in (
        ("measured", gathered.measured),
        ("reference", gathered.references),
        ("command", gathered.commands),
    ):
        for name, values in columns.items():
            known = values[~np.isnan(values)]
            span = (
                f"{known.min():>12.6g} to {known.max():<12.6g}" if len(known) else "no value at all"
            )
            lines.append(f"  {kind:<10}{name:<32}{span} {si_unit_of(name)}")
    judged = [trial for trial in gathered.trials if trial.judged]
    shown = ", ".join(
        f"{t.name} {grid.t_s[t.start]:.4g}-{grid.t_s[t.stop - 1]:.4g} s" for t in judged[:8]
    )
    lines.append(
        f"  {len(judged)} trial{'s' * (len(judged) != 1)}:"
        f" {shown}{', ...' if len(judged) > 8 else ''}"
    )
    return "\n".join([*lines, *(f"  note: {sentence}" for sentence in gathered.says)])
