"""Sensors at the end of their range: at the terminal's rail, or cut off flat where the motion goes
on.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.finding import Finding, measured_names, seconds, smooth, stretches
from epa_rt.gap.hygiene.values import scaling_of_row
from epa_rt.gap.recording import Recording
from epa_rt.signals.scaling import Scaling

_AT_RAIL_ROWS = 30
_FLAT_S = 0.015  # shortest flat piece at the highest or lowest value that counts
_BESIDE_S = 0.015  # the slope is looked at so far beside a flat piece
_SUDDEN = 0.25  # of the usual change over that time: a motion that turns or rests slows down before
_STEPS = 5.0  # of the converter, at least
_PIECES = 3


def check_ends(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on saturated channels. Of a rig of others no rail is known, and a place may run into
    a stop.
    """
    if rig is None:
        return [
            one
            for name in measured_names(recording)
            if not name.endswith(PLACES)
            for one in _cut_off(recording, name, recording.columns[name], 0.0)
        ]
    found = []
    rows = {row.name for row in rig.inputs}
    for name in (n for n in measured_names(recording) if n in rows):
        scaling, values = scaling_of_row(rig, name), recording.columns[name]
        if scaling is None or not np.isfinite(values).any():
            continue
        # a speed has plateaus of its own; where it is cut off it disagrees with the slope
        found += _at_rail(recording, name, values, scaling) or (
            [] if name == rig.motor.speed else _cut_off(recording, name, values, abs(scaling.slope))
        )
    return found


def _of(recording: Recording, name: str, sentence: str, rows: list) -> Finding:
    return Finding(
        "exclude",
        "saturated",
        recording.name,
        name,
        f"{recording.name}: {name}: {sentence}; they are left out",
        tuple(rows),
    )


def _at_rail(
    recording: Recording, name: str, values: np.ndarray, scaling: Scaling
) -> list[Finding]:
    """Values at the ends of what the terminal can say."""
    low, high = sorted((scaling.to_si(scaling.valid_low), scaling.to_si(scaling.valid_high)))
    one = 1.5 * abs(scaling.slope)
    near = np.isfinite(values) & ((values <= low + one) | (values >= high - one))
    if near.sum() < _AT_RAIL_ROWS:
        return []
    row = int(np.argmax(near))
    return [
        _of(
            recording,
            name,
            f"found {values[row]:.6g} on {int(near.sum())} rows from {seconds(recording, row):.3f}"
            f" s on, the end of its valid range ({low:.6g} to {high:.6g})",
            stretches(near),
        )
    ]


def _cut_off(recording: Recording, name: str, values: np.ndarray, count: float) -> list[Finding]:
    """Flat pieces at the highest or lowest value of the trials that a motion runs into without
    slowing down.
    """
    beside, flat = (max(round(s / recording.period_s), 3) for s in (_BESIDE_S, _FLAT_S))
    trials = [values[span.start : span.stop] for span in recording.spans if span.trial]
    known = np.concatenate([part[np.isfinite(part)] for part in trials] or [np.zeros(0)])
    if len(known) < 20 * beside:
        return []
    unique = np.unique(known)
    count = max(count, float(np.diff(unique).min()) if len(unique) > 1 else 0.0)
    calm = smooth(known, beside)
    usual = float(np.percentile(np.abs(calm[beside:] - calm[:-beside]), 95))
    found = []
    for end, word in ((unique[-1], "highest"), (unique[0], "lowest")):
        pieces, sudden = [], 0
        for span in (s for s in recording.spans if s.trial):
            for a, b in stretches(values[span.start : span.stop] == end):
                if b - a >= flat and a > 0:
                    a, b = a + span.start, b + span.start
                    pieces.append((a, b))
                    drops = [
                        abs(float(np.nanmean(values[slice(*where)])) - end)
                        for where in ((a - beside, a), (b, b + beside))
                        if span.start <= where[0] and where[1] <= span.stop
                    ]
                    sudden += (
                        bool(drops) and max(drops) > max(_SUDDEN * usual, _STEPS * count) * 0.5
                    )
        if sudden >= _PIECES and sudden >= 0.5 * len(pieces):
            found.append(
                _of(
                    recording,
                    name,
                    f"found it flat at {end:.6g}, its {word} value, on"
                    f" {sum(b - a for a, b in pieces)} rows in {len(pieces)} pieces that it runs"
                    " into without slowing down, the first at"
                    f" {seconds(recording, pieces[0][0]):.3f} s, as of a sensor at the end of its"
                    " range",
                    pieces,
                )
            )
    return found
