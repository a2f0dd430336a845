"""Numbers of an identification in words."""

import math

from epa_rt.identify.scores import Score
from epa_rt.models.knobs import row_of
from epa_rt.models.plant_file import stem_of

SHOWN = {
    "m": (1e3, "mm"),
    "Pa": (1e-3, "kPa"),
    "N/m": (1e-3, "kN/m"),
    "1": (1.0, ""),
    "N*s/m": (1.0, "N s/m"),
}


def number(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def percent(value: float) -> str:
    return f"{100.0 * value:.0f} %" if math.isfinite(value) else "–"


def condition(value: float) -> str:
    return (
        "–"
        if not math.isfinite(value) or value <= 1.0
        else f"{value:.0f}"
        if value < 1e4
        else f"{value:.0e}".replace("e+0", "e")
    )


def yes(has: bool) -> str:
    return "yes" if has else "no"


def coefficients(score: Score) -> list[tuple[str, str, str, str]]:
    """Name, value, 95 % interval, unit of every coefficient; numbers of a plant in workshop
    units.
    """
    rows = []
    for name, value in score.coefficients.items():
        low, high = score.intervals.get(name, (math.nan, math.nan))
        scale, unit, shown = 1.0, "", name
        if name.startswith("muscle0."):
            row = row_of(name)[1]
            scale, unit = SHOWN.get(row.unit, (1.0, row.unit))
            twice = (
                sum(key.startswith(f"muscle0.{stem_of(row)}_") for key in score.coefficients) > 1
            )
            shown = (row.name if twice else stem_of(row)).replace("_", " ")
        digits = _digits(high * scale - low * scale, value * scale)
        rows.append(
            (
                shown,
                f"{value * scale:.{digits}f}",
                (
                    f"{low * scale:.{digits}f} to {high * scale:.{digits}f}"
                    if math.isfinite(low)
                    else "not seen"
                ),
                unit,
            )
        )
    return rows


def _digits(width: float, value: float) -> int:
    """As many decimals as the interval's width is worth."""
    size = width if math.isfinite(width) and width > 0.0 else abs(value) * 1e-3
    return min(max(1 - math.floor(math.log10(size)), 0), 6) if size > 0.0 else 3
