"""List the effects that a diagnosis can name: parameters, bounds, typical strength, equation,
source.

  epa gap catalogue
  epa gap catalogue --json
  epa gap catalogue --kind servo      of a rig of others (docs/foreign-effects.md)
"""

import argparse
import json

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.gap.inputs import task_parser
from epa_rt.cli.outputs import add_json_argument, is_screen
from epa_rt.cli.write import check_writable, write_whole


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "catalogue", __doc__)
    add_json_argument(parser, "the list for machines")
    parser.add_argument(
        "--kind",
        help="of a kind of rig that is not ours: carriage, shaft, piston, chamber or servo",
    )


def run(arguments: argparse.Namespace) -> int:
    check_writable(arguments.json, (".json",))
    rows, equations = _foreign(arguments.kind) if arguments.kind else (catalogue_rows(), ())
    if arguments.json:
        text = json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False)
        write_whole(arguments.json, text + "\n")
    if not is_screen(arguments.json):
        _show(rows, equations)
    return COMPLETED


def _foreign(kind: str) -> tuple[list[dict], tuple[str, ...]]:
    """The rows of a kind of rig that is not ours, and its model."""
    from epa_rt.gap.rig.foreign.catalogue_page import rows
    from epa_rt.gap.rig.foreign.kinds import KINDS

    if kind not in KINDS:
        raise VerbError(f"--kind: found '{kind}', expected one of {', '.join(sorted(KINDS))}")
    return rows(KINDS[kind]), KINDS[kind].equations


def catalogue_rows() -> list[dict]:
    """One entry per effect, its knobs with unit, neutral value, bounds and typical strength."""
    from epa_rt.models.catalogue import CATALOGUE, knob
    from epa_rt.models.parameters import neutral_params

    neutral, rows = neutral_params(), []
    for effect in CATALOGUE:
        numbers = [
            (knob(key, neutral), typical)
            for key, typical in zip(effect.knobs, effect.starts[0], strict=True)
        ]
        rows.append(
            {
                "name": effect.name,
                "family": effect.family,
                "block": effect.block,
                "says": effect.says,
                "knobs": [
                    {
                        "key": one.key,
                        "unit": one.unit,
                        "neutral": one.value,
                        "low": one.low,
                        "high": one.high,
                        "typical": typical,
                        "scale": "",
                        "low_scale": "",
                    }
                    for one, typical in numbers
                ],
                "equation": effect.equation,
                "source": effect.source,
            }
        )
    return rows


def _show(rows: list[dict], equations: tuple[str, ...]) -> None:
    from rich import box
    from rich.table import Table

    from epa_rt.gap.report.terminal import console
    from epa_rt.gap.rig.foreign.catalogue_page import bounds, neutral, typical
    from epa_rt.report.shown import pretty

    table = Table(
        "Effect",
        "Family",
        "Block",
        "Knob",
        "Unit",
        "Neutral",
        "Bounds",
        "Typical",
        "What, equation, source",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for row in rows:
        for i, one in enumerate(row["knobs"] or [{}]):
            first = i == 0
            numbers = (
                (one["key"], pretty(one["unit"]), neutral(one), bounds(one), typical(one))
                if one
                else ("",) * 5
            )
            told = f"{row['says']}; {row['equation']}; {row['source']}" if first else ""
            table.add_row(
                *((row["name"], row["family"], row["block"]) if first else ("", "", "")),
                *numbers,
                told,
            )
    out = console()
    if not out.is_terminal:
        out.width = 260
    out.print(table)
    for line in equations:
        out.print(line, markup=False)
    out.print(f"{len(rows)} effects in {len({row['family'] for row in rows})} families")
