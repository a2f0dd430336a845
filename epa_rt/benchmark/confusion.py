"""What was said against what was true, by family, as a picture."""

from collections.abc import Callable, Sequence
from pathlib import Path

from epa_rt.benchmark.figures import Case, named

NOTHING = {
    "no_gap": "no gap",
    "not_in_catalogue": "not in the catalogue",
    "not_excited": "not excited",
    None: "an error",
}


def said_family(said: dict) -> str:
    """Family of the effect named first, or the verdict in words."""
    first = named(said)[:1]
    return (
        first[0].get("family") or first[0]["name"]
        if first
        else NOTHING.get(said.get("verdict"), str(said.get("verdict")))
    )


def true_family(truth: dict, effect: dict) -> str:
    """Family of a true effect; where it is withheld or was never in the catalogue, that."""
    if truth["kind"] == "withheld":
        return f"withheld: {effect['families'][0] if effect['families'] else effect['name']}"
    return effect["families"][0] if effect["families"] else effect["name"]


def counts(cases: Sequence[Case]) -> dict[str, dict[str, int]]:
    """True family (rows) to said family to number of cases; of a pair each effect counts, right
    where any name fits.
    """
    table: dict[str, dict[str, int]] = {}
    for truth, said in cases:
        for effect in truth["effects"] or [None]:
            row = (
                "nothing"
                if effect is None
                else "not excited"
                if truth["kind"] == "not_excited"
                else true_family(truth, effect)
            )
            families = [n.get("family") for n in named(said)]
            hit = [f for f in families if effect is not None and f in effect["families"]]
            cell = (
                row
                if hit and truth["kind"] not in ("withheld", "not_excited")
                else said_family(said)
            )
            table.setdefault(row, {})[cell] = table.get(row, {}).get(cell, 0) + 1
    return table


def confusion(
    cases: Sequence[Case], path: Path, title: str = "What was said against what was true, by family"
) -> None:
    """Writes the picture as an HTML page of its own."""
    draw(counts(cases), path, title, fits)


def fits(row: str, cell: str) -> bool:
    """Whether what was said is right for what was true."""
    if row.startswith("withheld"):
        return cell == NOTHING["not_in_catalogue"]
    return cell == row or cell == NOTHING["no_gap"] and row in ("nothing", NOTHING["not_excited"])


def draw(
    table: dict[str, dict[str, int]], path: Path, title: str, right: Callable[[str, str], bool]
) -> None:
    """A table of counts as a picture; rows true, columns said, the same order on both where they
    meet; blue right, orange wrong.

    ``table``: row to column to count. Writes an HTML page, making its folder. Raises ValueError for
    an empty table.
    """
    import plotly.graph_objects as go

    rows = sorted(table)
    said = {cell for row in table.values() for cell in row}
    columns = [row for row in rows if row in said] + sorted(said - set(rows))
    numbers = [[table[row].get(column, 0) for column in columns] for row in rows]
    words = [[str(n) if n else "" for n in line] for line in numbers]
    most = max(n for line in numbers for n in line)
    shown = [
        [
            (n if right(row, column) else -n) if n else None
            for column, n in zip(columns, line, strict=True)
        ]
        for row, line in zip(rows, numbers, strict=True)
    ]
    figure = go.Figure(
        go.Heatmap(
            z=shown,
            x=columns,
            y=rows,
            text=words,
            texttemplate="%{text}",
            showscale=False,
            xgap=1,
            ygap=1,
            zmin=-most,
            zmax=most,
            colorscale=[[0, "#d9691c"], [0.499, "#fbe3d0"], [0.501, "#dbe9f6"], [1, "#2166ac"]],
        )
    )
    figure.update_layout(
        title=f"{title} (blue: right, orange: wrong)",
        template="plotly_white",
        width=max(700, 26 * len(columns) + 330),
        height=max(420, 22 * len(rows) + 260),
        font={"size": 11},
        margin={"l": 10, "r": 20, "t": 50, "b": 10},
    )
    figure.update_xaxes(title="said", tickangle=-50, automargin=True, showgrid=True)
    figure.update_yaxes(title="true", autorange="reversed", automargin=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.write_html(path, include_plotlyjs=True, config={"displayModeBar": False})
