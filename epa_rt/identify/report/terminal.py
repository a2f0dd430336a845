"""An identification on the terminal: what the trials were, every model's score, coefficients,
terms.
"""

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from epa_rt.gap.report.terminal import console
from epa_rt.identify.answer import PAPER_R2, Answer
from epa_rt.identify.report.words import coefficients, condition, number, percent, yes
from epa_rt.identify.scores import Score

__all__ = ["console", "show"]


def _table(*heads: str, words: int = 1) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for i, head in enumerate(heads):
        table.add_column(head, justify="left" if i < words else "right", no_wrap=i == 0)
    return table


def _filled(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = _table(*heads)
    for row in rows:
        table.add_row(*row)
    for i, column in enumerate(table.columns):  # figures stay on one line, heads break at words
        words = (*heads[i].split(), *(row[i] for row in rows))
        column.min_width = max(map(len, words))
    return table


def _printed(table: Table, out: Console) -> None:
    """Prints a table of `_filled`; where it is too wide, each column is as wide as its figures."""
    most = out.measure(table, options=out.options.update(max_width=1000)).maximum
    if most > out.width:
        for column in table.columns:
            column.width = column.min_width
    out.print(table)


def _fit(table: Table, out: Console) -> bool:
    """Whether the terminal is wide enough to break no cell; heads may break."""
    least = out.measure(table, options=out.options.update(max_width=1000)).minimum
    return least <= out.width


def _fits(score: Score) -> tuple[str, ...]:
    return (
        number(score.r2),
        number(PAPER_R2[score.name]) if score.name in PAPER_R2 else "",
        number(score.rms_n, 2),
        number(score.r2_trial),
        number(score.r2_pressure),
        number(score.rms_trial_n, 2),
    )


def _loops(score: Score) -> tuple[str, ...]:
    return (
        percent(score.hysteresis),
        percent(score.loop_error),
        yes(score.has_hysteresis),
        f"{yes(score.has_damping)}, {score.damping_n_s_m:.1f}",
        condition(score.condition),
    )


def show(found: Answer, out: Console) -> None:
    """Everything that an operator needs to read before opening the page."""
    for sentence in found.remarks:
        out.print(f"note: {sentence}", style="yellow")
    kpa = sorted({round(t["p0_pa"] / 1e3) for t in found.trials})
    out.print(
        f"{len(found.trials)} trial{'s' * (len(found.trials) != 1)},"
        f" {sum(t['seconds'] for t in found.trials):.0f} s, no-load"
        f" pressures {', '.join(map(str, kpa))} kPa gauge"
    )
    out.print(f"normalised: {found.normalisation.said()}")
    _models(found, out)
    _coefficients(found, out)
    _terms(found, out)
    out.print(f"{found.seconds:.1f} s", style="dim")


_FITS = (
    "R2",
    "paper",
    "RMS, N",
    "R2 trial left out",
    "R2 pressure left out",
    "RMS trial left out, N",
)
_LOOPS = ("loop work", "loop error", "has hysteresis", "has damping, N s/m", "condition")


def _models(found: Answer, out: Console) -> None:
    rows = [(score.name, _fits(score), _loops(score)) for score in found.scores]
    whole = _filled(("Model", *_FITS, *_LOOPS), [(name, *a, *b) for name, a, b in rows])
    if _fit(whole, out):
        _printed(whole, out)
    else:  # two narrow ones
        _printed(_filled(("Model", *_FITS), [(name, *a) for name, a, _ in rows]), out)
        _printed(_filled(("Model", *_LOOPS), [(name, *b) for name, _, b in rows]), out)
    b, n = found.geometry
    out.print(f"static, b and n fitted: b = {b * 1e3:.2f} mm, n = {n:.3f}")
    if found.gas:
        gas = found.gas
        out.print(
            f"gas: Boyle misses the pressure by {gas.rms_boyle_pa / 1e3:.2f} kPa (R2"
            f" {gas.r2_boyle:.3f}); exponent {gas.polytropic_ratio:.3f} and leak"
            f" {gas.leak_per_s:.1e} 1/s beside {gas.dead_volume_m3 * 1e6:.1f} cm^3 of dead volume"
            f" by {gas.rms_pa / 1e3:.2f} kPa (R2 {gas.r2:.3f})"
        )


def _coefficients(found: Answer, out: Console) -> None:
    table = _table("Model", "Coefficient", "Value", "95 % interval", "Unit", words=2)
    for score in found.scores:
        for i, row in enumerate(coefficients(score)):
            table.add_row(score.name if i == 0 else "", *row)
    out.print(table)


def _terms(found: Answer, out: Console) -> None:
    if not found.selected:
        return
    heads = ("Choice of terms", "Terms", "R2", "condition", "R2 at five")
    rows, terms = [], []
    for way in found.selected:
        five = next((step for step in way.path if len(step.terms) == 5), None)
        which = (
            ", ".join(way.chosen.terms)
            if len(way.chosen.terms) <= 12
            else "at five: " + ", ".join(five.terms)
            if five
            else ""
        )
        figures = (number(way.chosen.r2), condition(way.chosen.condition))
        rows.append(
            (way.name, str(len(way.chosen.terms)), *figures, number(five.r2) if five else "")
        )
        terms.append(which)
    _printed(_filled(heads, rows), out)
    for way, which in zip(found.selected, terms, strict=True):
        out.print(f"{way.name}: {which or 'more than 12'}")
    out.print(
        "condition: of the chosen terms; "
        + "; ".join(f"{way.name}: {way.why}" for way in found.selected)
    )
