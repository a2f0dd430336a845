"""What a calibration says on the screen, for people and for machines."""

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epa_rt.config.units import plain, readable

if TYPE_CHECKING:
    from epa_rt.calibrate.calibration import Calibration
    from epa_rt.config.calibration_file import SignalCalibration

WIDTH = 79
FINEST = 1e-6  # of the span of a calibration: what is finer is rounding, and no offset


def lines(found: "Calibration", one: "SignalCalibration") -> list[str]:
    """At most 79 characters each."""
    scale, f, line = found.scale, found.findings, found.line
    shown, k = scale.shown, line.k
    factor, unit = scale.people
    gain = f"{factor * line.gain:.6g} {unit}/{scale.native}"
    percent = 100.0 * k * one.gain_ratio_uncertainty

    def share(value: float) -> str:
        return f"{shown(abs(value), 2)} ({100.0 * abs(value) / f.span:.2g} % of span)"

    rows = [
        ("gain", f"{gain} +- {percent:.2g} % (95 %, k {k:.3g})"),
        ("", f"{100.0 * (line.gain / scale.gain - 1.0):+.3g} % against the rig file"),
        (
            "value at 0 " + scale.native,
            f"{shown(line.offset)} +- {shown(k * line.offset_u, 2)} (95 %)",
        ),
        ("one sample", f"+- {shown(k * found.reading_u, 2)} (95 %, its noise included)"),
        ("points", f"{len(found.points)}, {shown(one.range[0])} to {shown(one.range[1])}"),
        ("largest miss", share(f.deviation)),
    ]
    for name, value in (
        ("bend", f.bend),
        ("hysteresis", f.hysteresis),
        ("repeatability", f.repeatability),
        ("zero, last-first", f.zero_drift),
    ):
        rows.append((name, "not known" if value is None else share(value)))
    said = [f"{one.signal}: {one.kind}, {one.when[:10]}, {one.operator or 'operator not named'}"]
    said += [f"  {name:16} {text}" for name, text in rows]
    for remark in found.remarks:
        said += textwrap.wrap(
            f"note: {remark}", WIDTH, initial_indent="  ", subsequent_indent="    "
        )
    return [part for text in said for part in _wrapped(text)]


def _wrapped(text: str) -> list[str]:
    return [text] if len(text) <= WIDTH else textwrap.wrap(text, WIDTH, subsequent_indent="    ")


def replaced_words(former: "SignalCalibration", one: "SignalCalibration") -> str:
    """What a new line took the place of: gain and offset before and after, with their units."""
    unit, step = one.si_unit, FINEST * (one.range[1] - one.range[0])
    offsets = [readable(step * round(each.offset / step) + 0.0, unit) for each in (former, one)]
    return (
        f"it replaces the calibration of {former.when}:"
        f" gain {plain(former.gain)} {unit}/{former.native} became"
        f" {plain(one.gain)} {unit}/{one.native}, offset {offsets[0]} became"
        f" {offsets[1]}; the former is not kept"
    )


def told(
    found: "Calibration", one: "SignalCalibration", path: Path, replaced: "SignalCalibration | None"
) -> dict[str, Any]:
    """The result as plain data, SI and native units in the keys' stead as text. ``replaced``: what
    stood in the file.
    """
    line, f = found.line, found.findings
    return {
        "file": str(path),
        "signal": one.signal,
        "unit": one.si_unit,
        "native": one.native,
        "gain": line.gain,
        "offset": line.offset,
        "gain_uncertainty": line.gain_u,
        "offset_uncertainty": line.offset_u,
        "correlation": line.correlation,
        "coverage_factor": line.k,
        "reading_uncertainty": found.reading_u,
        "against_rig_file": line.gain / found.scale.gain,
        "points": len(found.points),
        "scatter": f.scatter,
        "linearity": f.deviation,
        "bend": f.bend,
        "hysteresis": f.hysteresis,
        "repeatability": f.repeatability,
        "zero_drift": f.zero_drift,
        "remarks": list(found.remarks),
        "replaced": replaced
        and {"when": replaced.when, "gain": replaced.gain, "offset": replaced.offset},
    }
