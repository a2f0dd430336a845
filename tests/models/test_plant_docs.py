"""docs/plant.md lists every parameter as the tables have it."""

from pathlib import Path

from epa_rt.models.parameters import rows

PAGE = (Path(__file__).parents[2] / "docs" / "plant.md").read_text(encoding="utf-8")


def test_every_row_is_on_the_page():
    for block, row in rows():
        section = PAGE.split(f"\n### {block}\n")[1].split("\n### ")[0]
        line = (
            f"| `{row.name}` | {row.unit} | {row.neutral:.6g} | {row.low:.4g} to {row.high:.4g} |"
            f" {row.meaning} | {row.source} | {row.effect or ''} |"
        )
        assert line in section, (block, row.name)
