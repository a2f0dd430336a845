"""Points out of a log: those that a calibration marked, or the rests of two of its signals."""

import math
from pathlib import Path

import numpy as np

from epa_rt.calibrate.point import CalibrationError, Point, reading_of
from epa_rt.calibrate.readings import native_line
from epa_rt.calibrate.refusals import Scale
from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import SignalRow
from epa_rt.logs.reader import LogReader

REST_SHARE = 0.003  # of the span: what the mean may move between the halves of a window at rest
MERGE_SHARE = 0.01  # of the span: neighbouring windows that are one rest
MEASURED, CYCLE, MARK, DROP = "/measured", "/cycle", "calibration_point", "calibration_drop"


def points_of_log(
    path: Path,
    rig: Rig,
    row: SignalRow,
    scale: Scale,
    reference: str | None,
    reference_u: float | None,
    record_s: float,
) -> tuple[list[Point], bool]:
    """The points of a log, and whether a reference was a mass.

    ``reference``: the signal that the reading is held against; None: what the log's own calibration
    events say. ``rig``: the log's, which decoded it.

    Raises CalibrationError where there are none, LogError where the log cannot be read.
    """
    with LogReader(path) as log:
        names = [row.name] if reference is None else [row.name, reference]
        tables = log.tables({MEASURED: names, CYCLE: ["cycle"]})
        slope, intercept = native_line(rig, row)
        native = (tables[MEASURED][row.name] - intercept) / slope
        if reference is None:
            return _marked(path, log, row.name, native, tables[CYCLE]["cycle"], scale)
    values = tables[MEASURED][reference]
    if scale.si_unit == "Pa" and row.reads == "gauge":
        values = values - rig.atmosphere_pa  # signals are absolute
    size = max(20, round(record_s / rig.period_s))
    return _rests(path, native, values, size, scale, reference_u), False


def _marked(
    path: Path, log: LogReader, signal: str, native: np.ndarray, cycles: np.ndarray, scale: Scale
) -> tuple[list[Point], bool]:
    points: list[Point] = []
    any_mass = False
    for event in log.events():
        if event.kind == DROP and points:
            points.pop()
        if event.kind != MARK or event.data.get("signal") != signal:
            continue
        data = event.data
        try:
            first, last = int(str(data["first_cycle"])), int(str(data["last_cycle"]))
            value, u = float(str(data["reference"])), float(str(data["reference_u"]))
        except (KeyError, TypeError, ValueError, OverflowError):
            raise CalibrationError(
                f"{path}: found a damaged calibration event, expected reference and cycles"
            ) from None
        samples = native[np.searchsorted(cycles, first) : np.searchsorted(cycles, last, "right")]
        if len(samples) < 2:
            raise CalibrationError(
                f"{path}: found {len(samples)} samples of point {len(points) + 1}, expected its"
                " record"
            )
        any_mass |= data.get("is_mass") is True
        mean, mean_u, scatter, moved = reading_of(samples, scale.step)
        points.append(Point(value, u, mean, mean_u, scatter, moved, f"point {len(points) + 1}"))
    if not points:
        raise CalibrationError(
            f"{path}: found no point of {signal} marked in it, expected a log of epa calibrate, or"
            " --reference-signal NAME"
        )
    return points, any_mass


def _rests(
    path: Path,
    native: np.ndarray,
    values: np.ndarray,
    size: int,
    scale: Scale,
    reference_u: float | None,
) -> list[Point]:
    """One point per rest of both signals: windows that do not move, neighbours joined."""
    span = float(np.nanmax(values) - np.nanmin(values)) if np.isfinite(values).any() else 0.0
    groups: list[list[int]] = []
    last = -math.inf
    for start in range(0, len(values) - size + 1, size):
        part, other = values[start : start + size], native[start : start + size] * abs(scale.gain)
        if not (np.isfinite(part).all() and np.isfinite(other).all()):
            continue
        half = size // 2
        moves = max(abs(float(v[half:].mean() - v[:half].mean())) for v in (part, other))
        if moves > REST_SHARE * span:
            continue
        mean = float(part.mean())
        joins = groups and start == groups[-1][-1] + size and abs(mean - last) < MERGE_SHARE * span
        if joins:
            groups[-1].append(start)
        else:
            groups.append([start])
        last = mean
    points = []
    for number, starts in enumerate(groups, 1):
        chosen = slice(starts[0], starts[-1] + size)
        mean, mean_u, scatter, moved = reading_of(native[chosen], scale.step)
        of_reference = reading_of(values[chosen], 0.0)
        u = of_reference[1] if reference_u is None else math.hypot(reference_u, of_reference[1])
        u = max(u, 1e-9 * span, 1e-300)
        where = f"rest {number}"
        points.append(Point(of_reference[0], u, mean, mean_u, scatter, moved, where))
    if len(points) < 2:
        raise CalibrationError(
            f"{path}: found {len(points)} rests of {size} cycles, expected at least two in which"
            f" both signals stand still ({100.0 * REST_SHARE:g} % of their span)"
        )
    return points
