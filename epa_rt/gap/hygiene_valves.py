"""Valves against pressures: a muscle's pressure rises with its own inlet, not with another's."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.hygiene_finding import Finding, stretches
from epa_rt.gap.recording import Recording

_AFTER_S = 0.05        # an inlet that was open for longer shows in the pressure
_RISE_PA = 5e3


def check_valves(recording: Recording, rig: Rig) -> list[Finding]:
    """Findings on pressures that do not answer their valves."""
    muscles = [m for m in rig.muscles if {m.pressure, m.inlet, m.exhaust} <= set(recording.columns)]
    found = []
    for muscle in muscles:
        own = _rise(recording, muscle.inlet, muscle.pressure, [m.inlet for m in muscles if m is not muscle])
        if own is None or own > _RISE_PA:
            continue
        if own < -_RISE_PA:
            found.append(_of(recording, "sign", muscle.pressure, f"found it to fall by {-own / 1e3:.3g} kPa while {muscle.inlet} is open, expected it to rise"))
            continue
        other = next((m for m in muscles if m is not muscle and (_rise(recording, muscle.inlet, m.pressure, [m.inlet]) or 0.0) > _RISE_PA), None)
        if other is not None:
            found.append(_of(recording, "swapped", muscle.pressure, f"found {other.pressure} to rise with {muscle.inlet} and {muscle.pressure} not, expected it the other way round: the two are swapped"))
        else:
            found.append(Finding("note", "valve", recording.name, muscle.pressure, f"{recording.name}: {muscle.pressure}: found no rise while {muscle.inlet} is open, expected one"))
    return found


def _of(recording: Recording, kind: str, name: str, sentence: str) -> Finding:
    return Finding("refuse", kind, recording.name, name, f"{recording.name}: {name}: {sentence}")


def _rise(recording: Recording, inlet: str, pressure: str, others: list[str]) -> float | None:
    """Median rise of a pressure over long openings of an inlet while the other inlets are shut; None without one."""
    columns = recording.columns
    alone = (columns[inlet] != 0.0) & ~np.any([columns[name] != 0.0 for name in others] or [np.zeros(recording.samples, bool)], axis=0)
    least = round(_AFTER_S / recording.period_s)
    rises = [columns[pressure][b - 1] - columns[pressure][a] for a, b in stretches(alone) if b - a >= least]
    known = [rise for rise in rises if np.isfinite(rise)]
    return float(np.median(known)) if known else None
