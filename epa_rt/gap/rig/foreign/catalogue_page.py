"""What can be named on the rigs of others, kind by kind: rows for a list and a page for people
(docs/foreign-effects.md).
"""

from epa_rt.gap.rig.foreign.component import Component, Parameter
from epa_rt.gap.rig.foreign.kinds import KINDS
from epa_rt.models.catalogue_page import table_rows
from epa_rt.models.effect import Effect

_HEAD = """# Effects of rigs that are not ours

To look up what a diagnosis can name on a rig of others (carriage, shaft, piston, chamber, servo).
Kind by kind stand:

- the model with every number that it has, so that another person could write it again;
- settings, which are known of a rig, and nominal numbers, which no plant file knows exactly;
- the effects that can be named. Where a cell would be too long, the next row goes on.

A law's numbers stand in the order in which its equation has them. Bounds, neutral value and typical
strength are in units of what stands behind the *x*, settings of the rig file. With its neutral
value an effect is exactly absent. Files, units of columns, what to record:
[rigs of others](foreign-rigs.md). This page is written by
`epa_rt.gap.rig.foreign.catalogue_page.page()`, and a test holds it to the code.
"""


def rows(component: Component) -> list[dict]:
    """One entry per effect of a kind, its knobs with unit, neutral value, bounds and typical
    strength, all in units of ``scale`` ('' for the unit itself).
    """
    numbers = {row.key: row for row in component.parameters}
    return [
        {
            "name": effect.name,
            "family": effect.family,
            "block": effect.block,
            "says": effect.says,
            "knobs": [
                _knob(numbers[key], typical)
                for key, typical in zip(effect.knobs, effect.starts[0], strict=True)
            ],
            "equation": effect.equation,
            "source": effect.source,
        }
        for effect in component.effects
    ]


def _knob(row: Parameter, typical: float) -> dict:
    low_scale = row.low_scale or row.scale
    return {
        "key": row.key,
        "unit": row.unit,
        "neutral": row.neutral,
        "low": row.low,
        "high": row.high,
        "typical": typical,
        "scale": row.scale,
        "low_scale": low_scale,
    }


def bounds(one: dict) -> str:
    """'0 to 5 x typical_force', of an entry of ``rows``."""
    if one["low_scale"] != one["scale"]:
        return f"{one['low']:g} x {one['low_scale']} to {one['high']:g}{_times(one['scale'])}"
    return f"{one['low']:g} to {one['high']:g}{_times(one['scale'])}"


def typical(one: dict) -> str:
    """'0.3 x typical_force', of an entry of ``rows``."""
    return _sized(one["typical"], one)


def neutral(one: dict) -> str:
    """The same of the neutral value."""
    return _sized(one["neutral"], one)


def _sized(value: float, one: dict) -> str:
    return f"{value:g}{_times(one['scale'])}" if value else "0"


def _times(scale: str) -> str:
    return f" x {scale}" if scale else ""


def page() -> str:
    """docs/foreign-effects.md as text."""
    return _HEAD + "".join(_kind(component) for component in KINDS.values())


def _kind(component: Component) -> str:
    nominal = [row for row in component.parameters if row.effect is None]
    return "".join(
        [
            f"\n## {component.kind}: {component.says}\n\n",
            *(_clauses(line) for line in component.equations),
            "\n| Setting | Unit | Bounds | Default | Says |\n|---|---|---|---|---|\n",
            *(
                f"| `{s.name}` | {s.unit} | {s.low:g} to {s.high:g} |"
                f" {'must be said' if s.default is None else f'{s.default:g}'} | {s.says} |\n"
                for s in component.settings
            ),
            (
                "\n| Nominal | Unit | Bounds | Spread | Where the plant file is silent"
                " |\n|---|---|---|---|---|\n"
            ),
            *(_nominal(row) for row in nominal),
            (
                "\n| Family | Effect | Says | Equation | Numbers | Bounds | Neutral | Typical |"
                " Source |\n|---|---|---|---|---|---|---|---|---|\n"
            ),
            *(
                _effect(effect, row["knobs"])
                for effect, row in zip(component.effects, rows(component), strict=True)
            ),
        ]
    )


def _clauses(line: str) -> str:
    """An equation as an item of a list, what is said besides below it."""
    first, *rest = line.split("; ")
    return f"- {first}\n" + "".join(f"  - {clause}\n" for clause in rest)


def _nominal(row: Parameter) -> str:
    spread = f"{row.spread:g} {row.unit}" if row.absolute else f"{100 * row.spread:g} %"
    return (
        f"| `{row.key}` | {row.unit} | {row.low:g} to {row.high:g} | {spread} |"
        f" {'refused' if row.neutral is None else f'{row.neutral:g}'} |\n"
    )


def _effect(effect: Effect, knobs: list[dict]) -> str:
    names = ", ".join(f"`{one['key']}` {one['unit']}" for one in knobs)
    numbers = (
        "; ".join(bounds(one) for one in knobs),
        "; ".join(neutral(one) for one in knobs),
        "; ".join(typical(one) for one in knobs),
    )
    equation = effect.equation.replace("|", "\\|")
    return table_rows(
        effect.family, f"`{effect.name}`", effect.says, equation, names, *numbers, effect.source
    )
