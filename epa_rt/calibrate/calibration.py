"""From points to a calibration, or to the sentence why there is none."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.calibrate.findings import Findings, findings_of
from epa_rt.calibrate.line import Line, fit_line
from epa_rt.calibrate.point import Point
from epa_rt.calibrate.refusals import (
    Scale,
    check_each,
    check_line,
    check_order,
    check_outliers,
    columns,
)
from epa_rt.config.calibration_file import SignalCalibration
from epa_rt.config.units import with_unit

CHANGED = 0.02  # of the span: a change against the rig file that is worth a sentence


@dataclass(frozen=True)
class Common:
    """Standard uncertainties that all references share: of their scale (relative), of their zero
    (the signal's unit).
    """

    scale: float = 0.0
    zero: float = 0.0


@dataclass(frozen=True)
class Calibration:
    """A line that nothing speaks against, what else the points say, and what to be told of it."""

    points: tuple[Point, ...]
    line: Line
    findings: Findings
    scale: Scale
    reading_u: float
    repeat_u: float
    remarks: tuple[str, ...]

    @property
    def references(self) -> tuple[float, float]:
        values = [p.reference for p in self.points]
        return min(values), max(values)


def calibrate(
    points: Sequence[Point], scale: Scale, common: Common = Common(), is_new: bool = False
) -> Calibration:
    """The calibration of a reading. ``is_new``: another sensor, not held against the present line.

    Raises CalibrationError, one sentence.
    """
    check_each(points, scale)
    check_order(points, scale)
    x, y, ux, uy = columns(points)
    line = fit_line(x, y, ux, uy, common.scale, common.zero)
    if not is_new:
        check_line(points, line, scale)
    check_outliers(points, scale)
    found = findings_of(points, line)
    # between the records a sensor does not come back by more than within one
    repeat_u = found.repeatability or 0.0
    scatter = float(np.median([p.scatter for p in points]))
    parts = (
        float(line.std(x).max()),
        found.scatter,
        abs(line.gain) * scatter,
        abs(line.gain) * scale.step / math.sqrt(12.0),
        (found.hysteresis or 0.0) / math.sqrt(12.0) if found.has_hysteresis else 0.0,
    )
    reading_u = math.sqrt(sum(part * part for part in parts))
    return Calibration(
        tuple(points),
        line,
        found,
        scale,
        reading_u,
        repeat_u,
        tuple(_remarks(line, found, scale, y, x)),
    )


def _remarks(line: Line, found: Findings, scale: Scale, y: np.ndarray, x: np.ndarray) -> list[str]:
    shown, said = scale.shown, []
    if not line.believed:
        said.append(
            f"the points scatter {line.scale:.2g} times as much as their stated uncertainties: the"
            " scatter is used"
        )
    if len(y) == 2:
        said.append("two points: linearity and scatter are not known")
    if found.is_bent and found.bend is not None:
        share = 100.0 * abs(found.bend) / found.span
        said.append(
            f"the sensor is bent: {shown(found.bend, 2)} in the middle ({share:.2g} % of span)"
        )
    if found.has_hysteresis and found.hysteresis is not None:
        share = 100.0 * found.hysteresis / found.span
        said.append(
            f"hysteresis: up and down differ by {shown(found.hysteresis, 2)} ({share:.2g} %)"
        )
    drift = found.zero_drift
    if drift is not None and abs(drift) > 3.0 * math.sqrt(2.0) * abs(line.gain) * scale.step:
        said.append(f"the zero moved by {shown(drift, 2)} from its first to its last reading")
    ends = np.array([x.min(), x.max()])
    change = line.value(ends) - (scale.gain * ends + scale.offset)
    if float(np.abs(change).max()) > CHANGED * found.span:
        said.append(
            f"against the rig file the reading changes by {shown(float(change[0]), 3)} at the"
            f" low end and {shown(float(change[1]), 3)} at the high end"
        )
    return said


def as_file(
    calibration: Calibration,
    kind: str,
    entry: str,
    source: str,
    when: str,
    operator: str,
    serial: str,
    method: str,
) -> SignalCalibration:
    """The calibration as it stands in a file, numbers with units."""
    line, found, scale = calibration.line, calibration.findings, calibration.scale
    si, native = scale.si_unit, scale.native
    per = si if native == "1" else f"{si}/{native}"

    def in_si(value: float) -> str:
        return with_unit(f"{value:.9g}", si)

    def in_native(value: float) -> str:
        return with_unit(f"{value:.9g}", native)

    data: dict[str, object] = {
        "signal": scale.signal,
        "native": native,
        "kind": kind,
        "entry": entry,
        "source": source,
        "when": when,
        "operator": operator,
        "serial": serial,
        "method": method,
        "gain": f"{line.gain:.12g} {per}",
        "offset": in_si(line.offset),
        "gain_uncertainty": f"{line.gain_u:.9g} {per}",
        "offset_uncertainty": in_si(line.offset_u),
        "correlation": max(-1.0, min(1.0, line.correlation)),
        "coverage_factor": line.k,
        "reading_uncertainty": in_si(calibration.reading_u),
        "range": [in_si(end) for end in calibration.references],
        "linearity": in_si(found.deviation),
        "points": [
            {
                "reference": in_si(p.reference),
                "reference_uncertainty": in_si(p.reference_u),
                "reading": in_native(p.reading),
                "scatter": in_native(p.scatter),
                "reading_uncertainty": in_native(p.reading_u),
                "direction": way,
            }
            for p, way in zip(calibration.points, found.directions, strict=True)
        ],
    }
    for key in ("hysteresis", "repeatability", "zero_drift"):
        value = getattr(found, key)
        if value is not None:
            data[key] = in_si(value)
    return SignalCalibration.model_validate(data)
