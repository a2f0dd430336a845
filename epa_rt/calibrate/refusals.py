"""Reasons not to believe points: swapped, noisy, moving, a wrong unit, too few, off the scale."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.calibrate.line import Line, york
from epa_rt.calibrate.point import MOVING_SIGMAS, CalibrationError, Point
from epa_rt.config.calibration_file import MOST_POINTS

LEAST_SPAN = 20.0  # spans of the references in their own uncertainty: 5 % of gain, no more
MONOTONE_SIGMAS = 4.0  # of two neighbours: noise does that once in 30 000
MONOTONE_SHARE = 0.01  # of the span: hysteresis of a poor sensor turns neighbours round by less
SWAP_GAIN = 25.0  # times less chi-squared: an exchange that explains the points
NOISY = 5.0  # times the median scatter of the other points: loose wire, swinging mass
NOISY_OF_TWO = 10.0  # with one other point to compare with
MOVING_SHARE = 0.005  # of the span: a mass that swings, a pressure that leaks
MOST_TRIED = 40  # points of which every pair is exchanged to name two: a second of work
OUTLIER_P = 1e-3  # by chance, over all points together
LARGEST_CHANGE = 2.0  # of the gain: a sensor's own line and its wear differ by percents
NEAR_ZERO = 0.05  # of the sensor's range: below, its zero is more than its gain
UNIT_BAND = 0.1  # relative: how near a ratio is to a unit's factor to name it

# how a reference is too large by a factor: what was meant, what was read
_SUSPECTS = {
    "N": (
        (9.80665, "a mass in kg taken for a force in N, or kgf for N"),
        (4.44822, "lbf for N"),
        (2.20462, "lb for kg"),
        (1000.0, "kN for N, or kg for g"),
    ),
    "Pa": (
        (6.894757, "psi for kPa"),
        (14.50377, "psi for bar"),
        (100.0, "bar for kPa"),
        (1000.0, "kPa for Pa, or MPa for kPa"),
        (98.0665, "kgf/cm^2 for kPa"),
    ),
    "rad": ((57.29578, "rad for deg"), (360.0, "turns for deg"), (6.283185, "turns for rad")),
    "": ((10.0, "a decimal place"), (100.0, "two decimal places"), (1000.0, "a prefix")),
}


@dataclass(frozen=True)
class Scale:
    """What a reading is at now: its unit, the present line, the converter's ends and resolution
    (native), the sensor's ``valid`` range, and the rig's atmosphere where it is a pressure.
    """

    signal: str
    si_unit: str
    native: str
    gain: float
    offset: float
    converter: tuple[float, float]
    valid: tuple[float, float]
    step: float
    atmosphere_pa: float | None = None

    @property
    def people(self) -> tuple[float, str]:
        """Factor from SI to the unit that people read, and that unit."""
        return {"Pa": (1e-3, "kPa"), "rad": (180.0 / math.pi, "deg")}.get(
            self.si_unit, (1.0, self.si_unit)
        )

    def shown(self, value: float, digits: int = 5) -> str:
        """A value for a sentence, in the unit that people read."""
        factor, unit = self.people
        return f"{factor * value:.{digits}g} {unit}"


def check_each(points: Sequence[Point], scale: Scale) -> None:
    """Raises CalibrationError for what one point says by itself, or too few of them."""
    if len(points) > MOST_POINTS:
        raise CalibrationError(f"found {len(points)} points, expected at most {MOST_POINTS}")
    for p in points:
        check_reading(p, scale)
    values = sorted({p.reference for p in points})
    if len(values) < 2:
        raise CalibrationError(
            f"found {len(points)} point{'s' * (len(points) != 1)} at {len(values)} reference"
            f"{'s' * (len(values) != 1)}, expected at least two different references"
        )
    span, u = values[-1] - values[0], max(_u(p, scale.gain) for p in points)
    readings = [p.reading for p in points]
    moved = max(readings) - min(readings)
    if span < LEAST_SPAN * u:
        words = unit_suspects(span / abs(scale.gain * moved), scale.si_unit) if moved else ""
        why = f" (they look {words})" if words else ""
        raise CalibrationError(
            f"found references over {scale.shown(span)}, known to {scale.shown(u)}: too close"
            f" together{why}, expected at least {LEAST_SPAN:g} times their uncertainty"
        )
    if moved < 2.0 * scale.step:
        raise CalibrationError(
            f"found readings that stay at {readings[0]:.5g} {scale.native}, expected them to follow"
            " the reference (wrong signal, wire off?)"
        )
    for i, p in enumerate(points):
        check_rest(p, [o for j, o in enumerate(points) if j != i], scale, span)


def check_reading(p: Point, scale: Scale) -> None:
    """Raises CalibrationError for a value that is no number, or beyond converter or sensor."""
    numbers = (p.reference, p.reference_u, p.reading, p.reading_u, p.scatter, p.moved)
    if math.isfinite(p.reference) and math.isnan(p.reading):
        low, high = scale.valid
        raise CalibrationError(
            f"{p.where}: found a reading that is not valid (beyond the converter or the sensor's"
            f" range, a broken wire), expected {low:.4g} to {high:.4g} {scale.native} all the while"
        )
    if not all(math.isfinite(value) for value in numbers):
        raise CalibrationError(f"{p.where}: found a value that is no number, expected numbers")
    # noise reaches beyond the mean: three of its deviations must fit, or samples were cut off
    reach = 3.0 * p.scatter
    low, high = scale.converter
    if not low < p.reading - reach or not p.reading + reach < high:
        raise CalibrationError(
            f"{p.where}: found a reading of {p.reading:.5g} {scale.native} at the end of what"
            f" the converter shows, expected one within {low:.4g} to {high:.4g} {scale.native}"
        )
    low, high = scale.valid
    if not low <= p.reading <= high:
        raise CalibrationError(
            f"{p.where}: found a reading of {p.reading:.5g} {scale.native}, outside of what the"
            f" rig file calls valid, expected {low:.4g} to {high:.4g} {scale.native} (broken"
            " wire, or beyond the sensor's range)"
        )


def check_rest(p: Point, others: Sequence[Point], scale: Scale, span: float) -> None:
    """Raises CalibrationError for a point that is noisier than the others, or moved while it was
    taken. ``span``: of the references.
    """
    scatters = [o.scatter for o in others]
    if p.scatter > 0.0 and scatters:
        usual = max(float(np.median(scatters)), 0.5 * scale.step)
        most = (NOISY if len(scatters) > 1 else NOISY_OF_TWO) * usual
        if p.scatter > most:
            raise CalibrationError(
                f"{p.where} is noisy: its samples scatter by {p.scatter:.3g} {scale.native}, the"
                f" others' by {usual:.3g}, expected at most {most:.3g} (swinging mass, loose"
                " wire?): take it again"
            )
    moved = abs(scale.gain * p.moved)
    sigmas = abs(p.moved) / p.reading_u if p.reading_u > 0.0 else math.inf
    if sigmas > MOVING_SIGMAS and abs(p.moved) > scale.step and moved > MOVING_SHARE * span:
        raise CalibrationError(
            f"{p.where} was not at rest: the reading moved by {scale.shown(moved)} while it was"
            f" taken, expected less than {scale.shown(MOVING_SHARE * span)}: take it again, later"
        )


def _u(point: Point, gain: float) -> float:
    return math.hypot(point.reference_u, gain * point.reading_u)


def check_order(points: Sequence[Point], scale: Scale) -> None:
    """Raises CalibrationError where the reading does not follow the reference from point to
    point, and names two points whose exchange would mend it.
    """
    x, y, *_ = columns(points)
    sign = 1.0 if float(np.corrcoef(x, y)[0, 1]) >= 0.0 else -1.0
    slack = MONOTONE_SHARE * float(np.ptp(x))
    gain = abs(float(np.ptp(y)) / float(np.ptp(x)))
    groups = _by_reference(points)
    wrong = next(
        (
            (p, q)
            for lower, upper in zip(groups, groups[1:], strict=False)
            for p in lower
            for q in upper
            if sign * (q.reading - p.reading)
            < -MONOTONE_SIGMAS * math.hypot(_u(p, gain), _u(q, gain)) / gain - slack
        ),
        None,
    )
    if wrong is None:
        return
    p, q = wrong
    swap = _swap(points)
    guess = f": {swap[0].where} and {swap[1].where} look swapped" if swap else ""
    raise CalibrationError(
        f"found the reading of {q.where} ({scale.shown(q.reference)}, {q.reading:.5g}"
        f" {scale.native}) on the wrong side of that of {p.where} ({scale.shown(p.reference)},"
        f" {p.reading:.5g} {scale.native}), expected it to follow the reference{guess}"
        f"{_unit_of_one(points, scale)}"
    )


def _by_reference(points: Sequence[Point]) -> list[list[Point]]:
    """Points of one reference together, from the lowest to the highest."""
    groups: dict[float, list[Point]] = {}
    for p in points:
        groups.setdefault(p.reference, []).append(p)
    return [groups[reference] for reference in sorted(groups)]


def columns(points: Sequence[Point]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Readings, references and their uncertainties, (n,) each, as york takes them."""
    return (
        np.array([p.reading for p in points]),
        np.array([p.reference for p in points]),
        np.array([p.reading_u for p in points]),
        np.array([p.reference_u for p in points]),
    )


def _chi2(points: Sequence[Point]) -> float:
    return york(*columns(points))[3]


def _swap(points: Sequence[Point]) -> tuple[Point, Point] | None:
    """The two points whose references, exchanged, leave far less scatter than now."""
    if not 3 <= len(points) <= MOST_TRIED:
        return None
    now, best, pair = _chi2(points), math.inf, None
    for i in range(len(points)):
        for j in range(i):
            if points[i].reference == points[j].reference:
                continue
            tried = list(points)
            tried[i] = replace(points[i], reference=points[j].reference)
            tried[j] = replace(points[j], reference=points[i].reference)
            chi2 = _chi2(tried)
            if chi2 < best:
                best, pair = chi2, (points[j], points[i])
    return pair if best * SWAP_GAIN < now else None


def _unit_of_one(points: Sequence[Point], scale: Scale) -> str:
    """A point that alone has a reference in another unit, named; '' where none has."""
    for p in points:
        expected = scale.gain * p.reading + scale.offset
        if abs(expected) < 0.05 * max(abs(o.reference) for o in points):
            continue
        words = unit_suspects(p.reference / expected, scale.si_unit)
        others_fit = sum(
            abs(o.reference / (scale.gain * o.reading + scale.offset) - 1.0) < UNIT_BAND
            for o in points
            if o is not p and scale.gain * o.reading + scale.offset != 0.0
        )
        if words and 2 * others_fit >= len(points) - 1:
            return f"; {p.where} looks {words}"
    return ""


def unit_suspects(ratio: float, si_unit: str) -> str:
    """Which mistake of a unit makes a reference ``ratio`` times what it should be; '' where none
    is near.
    """
    if not ratio > 0.0:
        return ""
    found = []
    for factor, words in (*_SUSPECTS.get(si_unit, ()), *_SUSPECTS[""]):
        for power, side in ((1.0, "large"), (-1.0, "small")):
            distance = abs(math.log(ratio) - power * math.log(factor))
            near = abs(math.log(factor)) > 0.5 and distance < math.log1p(UNIT_BAND)
            if near and words:
                found.append((distance, f"too {side} by {factor:.4g} ({words})"))
    found.sort()
    best = [words for distance, words in found if distance <= found[0][0] + 0.03]
    return " or ".join(dict.fromkeys(best))


def check_line(points: Sequence[Point], line: Line, scale: Scale) -> None:
    """Raises CalibrationError where the line is far from the present one."""
    ratio = line.gain / scale.gain
    if ratio < 0.0:
        raise CalibrationError(
            f"found a gain of {line.gain:.5g} {scale.si_unit}/{scale.native} where the rig file has"
            f" {scale.gain:.5g}, of the other sign, expected the same: swapped points, or the"
            " sensor's wires exchanged"
        )
    if not 1.0 / LARGEST_CHANGE < ratio < LARGEST_CHANGE:
        words = unit_suspects(ratio, scale.si_unit)
        why = f": the references look {words}" if words else ""
        raise CalibrationError(
            f"found a gain of {line.gain:.5g} {scale.si_unit}/{scale.native}, {ratio:.4g} times the"
            f" rig file's, expected it within a factor of {LARGEST_CHANGE:g}{why}"
        )
    middle = 0.5 * (max(p.reading for p in points) + min(p.reading for p in points))
    shift = line.gain * middle + line.offset - scale.gain * middle - scale.offset
    atmosphere = scale.atmosphere_pa
    if atmosphere is not None and abs(abs(shift) / atmosphere - 1.0) < UNIT_BAND:
        raise CalibrationError(
            f"found a shift of {scale.shown(shift)} against the rig file's line, about one"
            " atmosphere, expected less: absolute pressures taken for gauge ones, or the reverse"
        )


def doubt_of(point: Point, before: Sequence[Point], scale: Scale) -> str:
    """What speaks against a point as soon as it is taken, for the operator to look at; ''."""
    expected = scale.gain * point.reading + scale.offset
    whole = abs(scale.gain) * (scale.valid[1] - scale.valid[0])
    if abs(expected) > NEAR_ZERO * whole and point.reference != 0.0:
        ratio = point.reference / expected
        if not 1.0 / LARGEST_CHANGE < ratio < LARGEST_CHANGE:
            words = unit_suspects(ratio, scale.si_unit)
            return f"the rig file says {scale.shown(expected)}" + (
                f": the reference looks {words}" if words else ""
            )
    try:
        if len({p.reference for p in (*before, point)}) > 2:
            check_order((*before, point), scale)
    except CalibrationError as error:
        return str(error)
    return ""


def check_outliers(points: Sequence[Point], scale: Scale) -> None:
    """Raises CalibrationError for a point that the line through the others does not explain, where
    there are enough of them to say so (t test of the deleted residual, over all points).
    """
    from scipy.special import stdtr

    n = len(points)
    if n < 4:
        return
    worst: tuple[float, Point, float] | None = None
    for i, p in enumerate(points):
        others = [o for j, o in enumerate(points) if j != i]
        x, y, ux, uy = columns(others)
        if np.ptp(y) == 0.0 or np.ptp(x) == 0.0:
            continue
        gain, offset, covariance, chi2 = york(x, y, ux, uy)
        free = n - 3
        scale2 = max(1.0, chi2 / free)
        at = np.array([p.reading, 1.0])
        u2 = _u(p, gain) ** 2 + float(at @ covariance @ at)
        off = p.reference - gain * p.reading - offset
        probability = 2.0 * float(stdtr(free, -abs(off) / math.sqrt(scale2 * u2))) * n
        if worst is None or probability < worst[0]:
            worst = (probability, p, off)
    if worst is not None and worst[0] < OUTLIER_P:
        _, p, off = worst
        raise CalibrationError(
            f"{p.where} lies {scale.shown(abs(off))} off the line through the others, more than"
            f" their scatter lets it (chance {worst[0]:.1g}), expected it on the line: take it"
            f" again{_unit_of_one(points, scale)}"
        )
