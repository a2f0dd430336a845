"""Units: channels against the rig's limits, against the counts they come in, and pressures against
the atmosphere.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import SignalRow
from epa_rt.gap.finding import Finding, judged_rows, seconds, stretches
from epa_rt.gap.hygiene.values import is_analog, scaling_of_row
from epa_rt.gap.recording import Recording

FACTORS = {
    1e3: "a thousand",
    1e-3: "a thousandth",
    1e5: "100 000 (bar for Pa)",
    1e-5: "a 100 000th (Pa for bar)",
    1e6: "a million",
    1e-6: "a millionth",
    57.29578: "180/pi (degrees for rad)",
    0.01745329: "pi/180 (rad for degrees)",
    9.5493: "60/2pi (rpm for rad/s)",
    0.104720: "2pi/60 (rad/s for rpm)",
    100.0: "a hundred",
    0.01: "a hundredth",
    10.0: "ten",
    0.1: "a tenth",
}
# Units that are near enough to SI for limits to hold: told by the size of a count alone, which they
# must meet to a hundredth.
NEARBY = {
    "N": {
        0.2248089: "pounds-force for N",
        0.1019716: "kilograms-force for N",
        4.448222: "N for pounds-force",
        9.80665: "N for kilograms-force",
    },
    "Pa": {1.450377e-4: "psi for Pa", 6894.757: "Pa for psi"},
    "m": {39.37008: "inches for m", 0.0254: "m for inches"},
}
_MEETS = 0.01
_OUTSIDE_SHARE = 0.01
_MOST_OUTSIDE = 0.2  # share of rows above which the rest says nothing
_BESIDE = 0.1  # of the span of the limits: a trip stops a little further on
_COUNTS_OFF = (0.2, 20.0)
_PRESENTED = 16.0  # counts that an analog terminal changes by: 12 bit, left-aligned in a word of 16
_ENOUGH_VALUES = 50
_ATMOSPHERE_OFF_PA = 40e3
_REST_S = 0.05
# relative: by which a step may be beside 1, 2 or 5 times a power of ten to be that of decimals in a
# text
_DECIMAL = 3e-3
_LEAST_COUNTS = 10.0  # by which a channel without limits changes
_ONE_SIDED = 0.5  # limits of which the negative one is smaller than this share of the positive one
_PUSHES = 0.03  # of the upper limit: more than any zero is off


def check_scale(recording: Recording, rig: Rig) -> list[Finding]:
    """Findings on units, gains and zeros that no sensor has."""
    found = []
    for row in rig.inputs:
        values = recording.columns.get(row.name)
        if values is None or row.name.endswith("_raw") or not np.isfinite(values).any():
            continue
        found += (
            _pushes(recording, row, values)
            or _outside(recording, row, values)
            or _counts(recording, rig, row, values)
        )
    for muscle in rig.muscles:
        if not any(finding.channel == muscle.pressure for finding in found):
            found += _atmosphere(recording, rig, muscle.pressure, muscle.inlet, muscle.exhaust)
    return found


def nearest_factor(ratio: float, unit: str = "") -> str:
    """A factor in words: a mistake of units that it looks like, or its number. ``unit``: SI unit of
    the channel, where it is known.
    """
    if not np.isfinite(ratio) or ratio == 0.0:
        return "no factor"
    best = min(factors_of(unit), key=lambda factor: abs(np.log(abs(ratio) / factor)))
    return FACTORS[best] if abs(np.log(abs(ratio) / best)) < 0.35 else f"{abs(ratio):.3g}"


def factors_of(unit: str) -> list[float]:
    """The factors that a channel's unit can be wrong by: only an angle is mistaken for degrees,
    only a pressure for bar.
    """
    angles, pressures = (57.29578, 0.01745329, 9.5493, 0.104720), (1e5, 1e-5)
    return [
        factor
        for factor in FACTORS
        if not (
            unit
            and ((factor in angles and "rad" not in unit) or (factor in pressures and unit != "Pa"))
        )
    ]


def _of(
    recording: Recording, severity: str, kind: str, name: str, sentence: str, rows: list = ()
) -> Finding:
    return Finding(
        severity, kind, recording.name, name, f"{recording.name}: {name}: {sentence}", tuple(rows)
    )


def _outside(recording: Recording, row: SignalRow, values: np.ndarray) -> list[Finding]:
    """Against the limits outside of which the rig would have tripped."""
    if row.limits is None:
        return []
    low, high = row.limits
    beside = _BESIDE * (high - low)
    judged = judged_rows(recording) & np.isfinite(values)
    outside = judged & ((values < low - beside) | (values > high + beside))
    if outside.sum() <= _OUTSIDE_SHARE * judged.sum():
        return []
    first = int(np.argmax(outside))
    share = outside.sum() / judged.sum()
    fits = [
        factor for factor in factors_of(row.si_unit) if _fits(values[judged] / factor, low, high)
    ]
    expected = f"{low:.6g} to {high:.6g} {row.si_unit}, the limits at which the rig trips"
    at = (
        f"found {values[first]:.6g} {row.si_unit} at {seconds(recording, first):.3f} s and"
        f" {share:.0%} of the rows outside of the limits, expected {expected}"
    )
    if share > 0.5:
        like = (
            "; the values look too large or small by"
            f" {FACTORS[min(fits, key=lambda f: abs(np.log(f)))]}"
            if fits
            else ""
        )
        return [_of(recording, "refuse", "units", row.name, at + like)]
    if share > _MOST_OUTSIDE:
        return [_of(recording, "refuse", "outside limits", row.name, at)]
    return [
        _of(
            recording,
            "exclude",
            "outside limits",
            row.name,
            at + "; they are left out",
            stretches(outside),
        )
    ]


def _fits(values: np.ndarray, low: float, high: float) -> bool:
    return bool(
        np.mean((values >= low) & (values <= high)) > 0.98 and np.ptp(values) > 1e-3 * (high - low)
    )


def _pushes(recording: Recording, row: SignalRow, values: np.ndarray) -> list[Finding]:
    """A muscle pulls: a force whose limits lie on one side is on that side."""
    if (
        row.limits is None
        or not row.name.endswith("_n")
        or -row.limits[0] > _ONE_SIDED * row.limits[1]
    ):
        return []
    known = values[judged_rows(recording) & np.isfinite(values)]
    low, high = np.percentile(known, (1.0, 99.0)) if len(known) else (0.0, 0.0)
    if -low < _PUSHES * row.limits[1] or -low < 3.0 * high:
        return []
    return [
        _of(
            recording,
            "refuse",
            "sign",
            row.name,
            f"found {low:.4g} to {high:.4g} {row.si_unit}, expected a force that pulls, which is"
            " positive: the sign looks wrong",
        )
    ]


def _counts(recording: Recording, rig: Rig, row: SignalRow, values: np.ndarray) -> list[Finding]:
    """A channel comes in counts of a known size; in another unit it comes in others."""
    scaling = scaling_of_row(rig, row.name)
    if scaling is None:
        return []
    unique = np.unique(values[np.isfinite(values)])
    gaps = np.diff(unique)
    gaps = gaps[gaps > 1e-9 * max(abs(unique[0]), abs(unique[-1]))]
    if len(gaps) < _ENOUGH_VALUES:
        return []
    step = float(gaps.min())
    near = gaps[gaps < 200.0 * step] / step
    if np.any(np.abs(near - np.rint(near)) > 0.05):
        return []  # no grid: not straight from a terminal
    presented = _PRESENTED if is_analog(rig, row.name) else 1.0
    ratio = step / abs(scaling.slope)
    if ratio < _COUNTS_OFF[0] and _of_text(
        step, row, float(unique[-1] - unique[0]), abs(scaling.slope) * presented
    ):
        return []
    if nearby := _nearby(ratio / presented, row.si_unit):
        return [
            _of(
                recording,
                "refuse",
                "units",
                row.name,
                f"found values in steps of {step:.4g} {row.si_unit}, expected steps of"
                f" {step / nearby:.4g} {row.si_unit}: they look like {NEARBY[row.si_unit][nearby]}",
            )
        ]
    if _COUNTS_OFF[0] <= ratio <= _COUNTS_OFF[1]:
        return []
    ratio /= presented
    expected = abs(scaling.slope) * presented
    return [
        _of(
            recording,
            "refuse",
            "units",
            row.name,
            f"found values in steps of {step:.3g} {row.si_unit}, expected steps of about"
            f" {expected:.3g} {row.si_unit}, the least that it can change by: the values look too"
            f" {'large' if ratio > 1.0 else 'small'} by {nearest_factor(ratio, row.si_unit)}",
        )
    ]


def _of_text(step: float, row: SignalRow, span: float, count: float) -> bool:
    """Whether steps are those of decimals in a text, of a channel that does not come in counts: 1,
    2 or 5 times a power of ten, in degrees too, where the channel changes by more than it could in
    a unit that makes it small as well. A unit mistaken for another keeps the count's own odd
    number.
    """
    for size, smallest in ((1.0, 1e-3), (np.pi / 180.0, np.pi / 180.0))[
        : 2 if "rad" in row.si_unit else 1
    ]:
        mantissa = step / size / 10.0 ** np.floor(np.log10(step / size))
        least = (
            _LEAST_COUNTS * count
            if row.limits is None
            else smallest * (1.0 + 2.0 * _BESIDE) * (row.limits[1] - row.limits[0])
        )
        if span > least and any(
            abs(mantissa / one - 1.0) < _DECIMAL for one in (1.0, 2.0, 5.0, 10.0)
        ):
            return True
    return False


def _nearby(ratio: float, unit: str) -> float | None:
    """The factor of a unit near to SI that a count's size meets; None where it meets none."""
    return next(
        (factor for factor in NEARBY.get(unit, {}) if abs(ratio / factor - 1.0) < _MEETS), None
    )


def _atmosphere(
    recording: Recording, rig: Rig, pressure: str, inlet: str, exhaust: str
) -> list[Finding]:
    """A muscle that has been vented for long stands at the atmosphere's pressure."""
    columns = recording.columns
    if not {pressure, inlet, exhaust} <= set(columns):
        return []
    vented = (columns[inlet] == 0.0) & (columns[exhaust] != 0.0)
    rest = round(_REST_S / recording.period_s)
    quiet = [
        columns[pressure][max(b - rest, a) : b] for a, b in stretches(vented) if b - a >= 2 * rest
    ]
    flat = [
        float(np.mean(part))
        for part in quiet
        if np.isfinite(part).all()
        and abs(np.mean(part[: rest // 2]) - np.mean(part[rest // 2 :])) < 1e3
    ]
    if not flat:
        return []
    lowest = min(flat)
    off = lowest - rig.atmosphere_pa
    if abs(off) < _ATMOSPHERE_OFF_PA:
        return []
    like = (
        "; it looks like a gauge pressure taken for an absolute one"
        if abs(lowest) < _ATMOSPHERE_OFF_PA
        else (
            "; it looks like an absolute pressure taken for a gauge one"
            if abs(off - rig.atmosphere_pa) < _ATMOSPHERE_OFF_PA
            else ""
        )
    )
    return [
        _of(
            recording,
            "refuse",
            "zero",
            pressure,
            f"found {lowest / 1e3:.4g} kPa with the muscle vented, expected about"
            f" {rig.atmosphere_pa / 1e3:.4g} kPa, the atmosphere{like}",
        )
    ]
