"""Valves against pressures: a muscle's pressure rises with its own inlet, not with another's."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.finding import Finding, regular, smooth
from epa_rt.gap.recording import Recording

_SMOOTH_S = 0.01
_LEAST_S = 0.05  # an inlet that was open for less in all says nothing
_CLEAR = 3.0  # how many times larger a rate must be to be called another's
_SLOW_PA_S = 10e3  # rates below are no answer to a valve


def check_valves(recording: Recording, rig: Rig) -> list[Finding]:
    """Findings on pressures that do not answer their valves."""
    muscles = [m for m in rig.muscles if {m.pressure, m.inlet, m.exhaust} <= set(recording.columns)]
    if not muscles:
        return []
    rate = _rates(recording, muscles)
    found = []
    for i, muscle in enumerate(muscles):
        others = [j for j in range(len(muscles)) if j != i]
        if np.isnan(rate[i, i]):
            continue
        if rate[i, i] < -_SLOW_PA_S and rate[i, i] < -_CLEAR * _SLOW_PA_S:
            found.append(
                _of(
                    recording,
                    "sign",
                    muscle.pressure,
                    f"found it to fall by {-rate[i, i] / 1e3:.3g} kPa/s while {muscle.inlet} is"
                    " open, expected it to rise",
                )
            )
        elif any(
            rate[j, i] > max(_CLEAR * abs(rate[i, i]), _SLOW_PA_S)
            and rate[i, j] > max(_CLEAR * abs(rate[j, j]), _SLOW_PA_S)
            for j in others
        ):
            other = muscles[others[0]]
            found.append(
                _of(
                    recording,
                    "swapped",
                    muscle.pressure,
                    f"found {other.pressure} to rise with {muscle.inlet} by"
                    f" {rate[others[0], i] / 1e3:.3g} kPa/s and {muscle.pressure} by"
                    f" {rate[i, i] / 1e3:.3g} kPa/s, expected it the other way round: the two are"
                    " swapped",
                )
            )
    return found


def _of(recording: Recording, kind: str, name: str, sentence: str) -> Finding:
    return Finding("refuse", kind, recording.name, name, f"{recording.name}: {name}: {sentence}")


def _rates(recording: Recording, muscles: list) -> np.ndarray:
    """Pa/s of each pressure (rows) with each inlet open (columns), all valves fitted at once; NaN
    of one that hardly opened.
    """
    window = max(round(_SMOOTH_S / recording.period_s), 1)
    valves = [
        regular(recording, name) for muscle in muscles for name in (muscle.inlet, muscle.exhaust)
    ]
    opened = np.column_stack([smooth(valve, window) for valve in valves])
    slopes = np.column_stack(
        [
            np.gradient(smooth(regular(recording, m.pressure), window), recording.period_s)
            for m in muscles
        ]
    )
    rows = (opened > 0.0).any(axis=1)
    rate = np.full((len(muscles), len(muscles)), np.nan)
    if rows.sum() < 20:
        return rate
    fitted = np.linalg.lstsq(opened[rows], slopes[rows], rcond=None)[0].T[:, ::2]
    enough = np.array(
        [(valves[2 * i] != 0.0).sum() * recording.period_s > _LEAST_S for i in range(len(muscles))]
    )
    return np.where(enough, fitted, np.nan)
