"""One self-contained HTML page for one calibration: line, residuals, what speaks against it."""

from typing import TYPE_CHECKING

import numpy as np

from epa_rt.calibrate.calibration import Calibration
from epa_rt.config.calibration_file import SignalCalibration
from epa_rt.report.charts import ACCENT, ERROR, REFERENCE, SECOND, Figure, Line, Panel, embed, stack
from epa_rt.report.markup import Html, facts, join, note, paragraph, table, tag, warning
from epa_rt.report.page import page
from epa_rt.report.sections.section import Section

if TYPE_CHECKING:
    from collections.abc import Sequence

BAND_POINTS = 60  # of the drawn uncertainty band: a hyperbola, smooth at this many
WORDS = {"up": "going up", "down": "going down"}


def calibration_page(found: Calibration, one: SignalCalibration) -> str:
    """The page of a calibration that was written."""
    sections = [
        Section("points", "Points and line", _pictures(found)),
        Section("sensor", "What the points say of the sensor", _findings(found)),
        Section("table", "Each point", _table(found)),
        Section("how", "How it was made", _how(found, one)),
    ]
    return page(f"Calibration of {one.signal}", _header(found, one), sections)


def _header(found: Calibration, one: SignalCalibration) -> Html:
    scale, line = found.scale, found.line
    factor, unit = scale.people
    k = line.k
    of = "" if one.source == "rig" else f" (from a {one.source})"
    return join(
        [
            tag("p", f"Calibration, {one.kind}{of}", class_="kicker"),
            tag(
                "h1",
                f"{one.signal}: {factor * line.gain:.6g} {unit}/{scale.native},"
                f" {factor * line.offset:.5g} {unit} at 0 {scale.native}",
            ),
            *(warning(remark) for remark in found.remarks),
            facts(
                [
                    ("Date", one.when[:10]),
                    ("Operator", one.operator or "not named"),
                    ("Serial number", one.serial or "not named"),
                    ("Gain, ± 95 %", f"± {100.0 * k * one.gain_ratio_uncertainty:.2g} %"),
                    ("Zero, ± 95 %", f"± {scale.shown(k * one.zero_uncertainty, 2)}"),
                    ("One sample, ± 95 %", f"± {scale.shown(k * found.reading_u, 2)}"),
                    ("Against the rig file", f"{100.0 * (line.gain / scale.gain - 1.0):+.3g} %"),
                ]
            ),
        ]
    )


def bars(x: np.ndarray, y: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upright strokes of y - u to y + u at each x, as one broken line."""
    gap = np.full_like(x, np.nan)
    return np.column_stack((x, x, gap)).ravel(), np.column_stack((y - u, y + u, gap)).ravel()


def _pictures(found: Calibration) -> Html:
    return join([embed(_figure(found)), note(_caption(found))])


def _caption(found: Calibration) -> str:
    return (
        "Above: references over readings, with the fitted line; dashed, the rig file's until now."
        " Below: what the line says less the reference. Strokes are the 95 % uncertainty of a"
        " point, grey lines that of the line."
    )


def _figure(found: Calibration) -> Figure:
    scale, line, f = found.scale, found.line, found.findings
    factor, unit = scale.people
    x = np.array([p.reading for p in found.points])
    y = np.array([p.reference for p in found.points])
    u = np.array([_point_u(found, i) for i in range(len(x))])
    wide = np.linspace(x.min(), x.max(), BAND_POINTS)
    band = line.k * line.std(wide)
    ways: Sequence[tuple[str, str]] = [("up", ACCENT), ("down", SECOND)]
    is_way = {way: np.array([w == way for w in f.directions]) for way, _ in ways}
    above, below = [], []
    for way, colour in ways:
        chosen = is_way[way]
        if not chosen.any():
            continue
        above.append(Line(x[chosen], factor * y[chosen], WORDS[way], colour, mode="markers"))
        below.append(
            Line(x[chosen], factor * f.residuals[chosen], WORDS[way], colour, mode="markers")
        )
        bar_x, bar_y = bars(x[chosen], factor * f.residuals[chosen], factor * line.k * u[chosen])
        below.append(Line(bar_x, bar_y, WORDS[way], colour, 1.0))
    present = scale.gain * wide + scale.offset
    above.append(Line(wide, factor * line.value(wide), "fitted", ACCENT))
    above.append(Line(wide, factor * present, "before", REFERENCE, dash="dash"))
    below += [
        Line(wide, factor * band, "95 % band", REFERENCE),
        Line(wide, -factor * band, "95 % band", REFERENCE),
    ]
    if f.is_bent and f.bend is not None:
        t = (2.0 * wide - x.max() - x.min()) / (x.max() - x.min())
        arc = f.bend * (t**2 - 1.0 / 3.0)
        below.append(Line(wide, factor * arc, "bend", ERROR, dash="dot"))
    return stack(
        [Panel("Reference", unit, above, height=300), Panel("Residual", unit, below, height=190)],
        x_title=f"reading, {scale.native}",
    )


def _point_u(found: Calibration, i: int) -> float:
    """Standard uncertainty of a point across the line, scaled as the fit was."""
    p = found.points[i]
    return found.line.scale * float(np.hypot(p.reference_u, found.line.gain * p.reading_u))


def _findings(found: Calibration) -> Html:
    f, shown, span = found.findings, found.scale.shown, found.findings.span

    def row(name: str, value: float | None, words: str, takes: str = "") -> list[str]:
        if value is None:
            return [name, "not known", "", takes or words]
        return [name, shown(abs(value), 2), f"{100.0 * abs(value) / span:.2g} %", words]

    def chance(p: float | None, real: bool) -> str:
        return "" if p is None else f"{'real' if real else 'not significant'}, chance {p:.1g}"

    rows = [
        row("Scatter", f.scatter, "standard deviation about the line"),
        row("Linearity", f.deviation, "largest distance of a point from the line"),
        row("Bend", f.bend, chance(f.bend_p, f.is_bent), "takes four places or more"),
        row(
            "Hysteresis",
            f.hysteresis,
            chance(f.hysteresis_p, f.has_hysteresis),
            "takes points up and down",
        ),
        row(
            "Repeatability",
            f.repeatability,
            "standard deviation at one reference",
            "takes a reference twice",
        ),
        row(
            "Zero, last less first",
            f.zero_drift,
            "of the lowest reference",
            "takes the lowest reference at begin and end",
        ),
    ]
    return table(("", "Value", "of span", "Meaning"), rows, (0, 3))


def _table(found: Calibration) -> Html:
    scale, f = found.scale, found.findings
    factor, unit = scale.people
    rows = [
        [
            str(i + 1),
            way,
            f"{factor * p.reference:.5g}",
            f"{factor * p.reference_u:.2g}",
            _to_its_uncertainty(p.reading, p.reading_u),
            f"{p.scatter:.2g}",
            f"{p.reading_u:.2g}",
            f"{factor * r:.2g}",
        ]
        for i, (p, way, r) in enumerate(zip(found.points, f.directions, f.residuals, strict=True))
    ]
    head = (
        "Point",
        "Way",
        f"Reference, {unit}",
        f"± standard, {unit}",
        f"Reading, {scale.native}",
        f"Scatter, {scale.native}",
        f"± of mean, {scale.native}",
        f"Residual, {unit}",
    )
    return table(head, rows, (0, 1))


def _to_its_uncertainty(value: float, uncertainty: float) -> str:
    """A number with two digits of its uncertainty."""
    if not uncertainty > 0.0:
        return f"{value:.6g}"
    return f"{value:.{max(0, 1 - int(np.floor(np.log10(uncertainty))))}f}"


def _how(found: Calibration, one: SignalCalibration) -> Html:
    line = found.line
    believed = (
        "The points scatter as their stated uncertainties say"
        if line.believed
        else "The points scatter more than was stated; their scatter is used"
    )
    return join(
        [
            paragraph(one.method or "Not said."),
            paragraph(
                "Line: least squares with errors in reference and reading (York 2004)."
                f" {believed}: factor {line.scale:.2g}, {line.dof:.3g} degrees of freedom, coverage"
                f" factor {line.k:.3g} for 95 %."
            ),
            paragraph(
                f"Correlation of gain and offset {line.correlation:.3f}. Entry {one.entry}, one"
                f" step of the converter {found.scale.step:.3g} {found.scale.native}."
            ),
        ]
    )
