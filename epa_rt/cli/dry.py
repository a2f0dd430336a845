"""A dry run for the operator: a table of phases on the screen, a picture of the references as a
page.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import write_whole

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.experiments.dry import DryRun
    from epa_rt.experiments.experiment import Experiment


def show_dry_run(experiment: "Experiment", rig: "Rig", out: Path) -> Sequence[str]:
    """Prints the phases and what they reach; writes ``dry-EXPERIMENT-RIG.html`` into the folder
    ``out``.

    Returns the findings, a sentence each; none where the rig can follow. Raises VerbError where it
    cannot write.
    """
    from epa_rt.experiments.dry import dry_run
    from epa_rt.report.dry import dry_page, dry_rows
    from epa_rt.report.shown import count, seconds
    from epa_rt.report.words import experiment_file, repeat_words

    dry = dry_run(experiment, rig)
    head, rows = dry_rows(dry, rig)
    print(filled(f"{experiment.name} on {rig.name}: {experiment.description}"))
    _print_table(head, rows)
    repeated = repeat_words(experiment_file(experiment.text))
    if repeated:
        print(filled(repeated))
    phases, trials = count(len(dry.phases), "phase"), len(experiment.trials)
    print(
        f"about {seconds(dry.duration_s)} in {phases}, {trials} of them"
        f" {'a trial' if trials == 1 else 'trials'}; nothing has moved"
    )
    for finding in dry.findings:
        print(filled(f"FINDING: {finding}"))
    print("the rig cannot follow this" if dry.findings else "within every limit of the rig")
    page = page_path(out, dry, rig)
    write_whole(page, dry_page(dry, rig))
    print(f"picture: {page}")
    return dry.findings


def page_path(out: Path, dry: "DryRun", rig: "Rig") -> Path:
    """Where the picture goes; beside the log where ``out`` names one."""
    folder = out.parent if out.suffix == ".mcap" else out
    return folder / f"dry-{dry.experiment.name}-{rig.name}.html"


def _print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Columns that do not wrap: a terminal too narrow for them gets two lines a phase."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(*head, box=box.SIMPLE_HEAD, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console = Console(highlight=False, markup=False, width=220)
    unbounded = console.options.update(max_width=1000)
    if console.measure(table, options=unbounded).maximum > console.width:
        print(filled(narrow_table(head, rows)))
    else:
        console.print(table)


def narrow_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The rows of `epa_rt.report.dry.dry_rows` as two lines each: figures in columns, then how
    often, motion and valves in words.
    """
    figures = [[row[i] for i in (0, 2, 4, 5, 6)] for row in (head, *rows)]
    widths = [max(len(cell) for cell in column) for column in zip(*figures, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip()
        for cells in figures
    ]
    for i, row in enumerate(rows, start=1):
        lines[i] += f"\n    {row[1]} x {row[3]}; valves: {row[7]}"
    return "\n".join(lines)
