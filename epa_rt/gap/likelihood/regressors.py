"""Terms of the data-driven residual model: what a residual may depend on, made from a link's
measured states.

A group is what a person would name at once ("sign of muscle_speed_m_s", "muscle_length_m, memory
0.3"); it holds one or several columns. Everything is made from measured states alone, so that it
knows no effect and no law.
"""

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.likelihood.stop_operator import stop_over_log

LAGS_S = (0.02, 0.05, 0.15)
CREEP_S = (0.1, 1.0, 10.0)
PLAYS = (0.02, 0.07, 0.2)  # half widths of the play operators, as parts of the state's own range
TURNS = (1, 2, 4, 6)
SPEEDS = ("_m_s", "_rad_s")
# ends the name of an angle that is another state in other units: only what swings over it is a term
# of its own
TURN = "_turn_rad"


def terms(states: Mapping[str, np.ndarray], rate_hz: float) -> dict[str, np.ndarray]:
    """Groups of columns (n, k) by name from states (n,) at ``rate_hz``. NaN where a state is NaN;
    not yet scaled.
    """
    found: dict[str, np.ndarray] = {}
    scaled = {
        name: _scaled(values)
        for name, values in states.items()
        if np.nanstd(values) > 0.0 and not name.endswith(TURN)
    }
    for name, z in scaled.items():
        found[name] = np.column_stack([z, z * z, z * z * z])
        found[f"rate of {name}"] = _rate(z, rate_hz)[:, None]
        found[f"{name} some time ago"] = np.column_stack(
            [_lagged(z, round(lag * rate_hz)) - z for lag in LAGS_S]
        )
        found[f"{name}, slowly forgotten"] = np.column_stack(
            [_forgotten(z, tau * rate_hz) for tau in CREEP_S]
        )
        if name.endswith(SPEEDS):
            found[f"sign of {name}"] = np.column_stack(
                [np.tanh(z / width) for width in (0.02, 0.1, 0.4)]
            )
            found[f"size of {name}"] = np.column_stack([np.abs(z), z * np.abs(z)])
        elif name.endswith(PLACES):
            found[f"memory of {name}"] = np.column_stack(
                [_play(z, width * np.ptp(z[np.isfinite(z)])) for width in PLAYS]
            )
    for name, angle in states.items():
        if "angle" in name and name in scaled or name.endswith(TURN):
            found[f"turn of {name}"] = np.column_stack(
                [f(k * angle) for k in TURNS for f in (np.sin, np.cos)]
            )
    found.update(_products(scaled, found))
    return found


def _products(
    scaled: Mapping[str, np.ndarray], singles: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Every pair of states, and every state that scales what has a direction: the sign of a speed,
    a memory.
    """
    found = {}
    names = sorted(scaled)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            found[f"{a} x {b}"] = (scaled[a] * scaled[b])[:, None]
    directed = [name for name in singles if name.startswith(("sign of", "memory of"))]
    for name in directed:
        for other in names:
            if other not in name and not other.endswith(SPEEDS):
                found[f"{name} x {other}"] = singles[name] * scaled[other][:, None]
    return found


def _scaled(values: np.ndarray) -> np.ndarray:
    return (values - np.nanmean(values)) / np.nanstd(values)


def _rate(z: np.ndarray, rate_hz: float) -> np.ndarray:
    return np.gradient(z) * rate_hz


def _lagged(z: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.full(samples, np.nan), z[:-samples]]) if samples else z


def _forgotten(z: np.ndarray, samples: float) -> np.ndarray:
    """What a first-order memory of so many samples lags behind; NaN is passed over and stays
    NaN.
    """
    whole = np.where(np.isfinite(z), z, 0.0)
    keep = np.exp(-1.0 / samples)
    slow = lfilter([1.0 - keep], [1.0, -keep], whole)
    return np.where(np.isfinite(z), whole - slow, np.nan)


def _play(z: np.ndarray, half: float) -> np.ndarray:
    """Where in its dead band a state lies (-1 to 1) after its own history: a stop operator, scaled
    by its half width.
    """
    return stop_over_log(np.ascontiguousarray(z), half) / half if half > 0.0 else np.zeros_like(z)
