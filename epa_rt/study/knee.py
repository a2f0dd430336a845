"""The knee study (Fig. 9): a chirp through the loop at pressures of serial and parallel muscle;
energy per period and what is saved.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from epa_rt.study.setting import load_setting

KEYS = (
    "rig",
    "spam",
    "ppam",
    "peak_to_peak",
    "from",
    "to",
    "seconds",
    "catalogue_spam",
    "catalogue_ppam",
    "catalogue_frequency",
)
# stands for the pressure of a parallel muscle that is vented and then shut where the knee hangs, so
# that it carries nothing
NONE = 0.0
FADE_S = 2.0


@dataclass(frozen=True)
class Knee:
    """What is asked: absolute pressures (Pa; 0: none), the chirp (rad peak to peak, Hz, s), and the
    catalogue's axes.
    """

    name: str
    rig: Path
    spam_pa: np.ndarray
    ppam_pa: np.ndarray
    peak_to_peak_rad: float
    from_hz: float
    to_hz: float
    seconds: float
    catalogue_spam_pa: np.ndarray
    catalogue_ppam_pa: np.ndarray
    catalogue_rad_s: np.ndarray

    @property
    def conditions(self) -> list[tuple[float, float]]:
        """(SPAM, PPAM) in Pa; no parallel muscle first in each group of one serial pressure."""
        return [(float(s), p) for s in self.spam_pa for p in (NONE, *map(float, self.ppam_pa))]


@dataclass(frozen=True)
class Periods:
    """One row per whole period of the chirp, (K,) each: frequency (Hz), E of eq. (9) (A^2 s),
    knee's swing peak to peak (rad), largest current (A).
    """

    hz: np.ndarray
    energy_a2_s: np.ndarray
    swing_rad: np.ndarray
    peak_current_a: np.ndarray


def load_knee(path: Path) -> Knee:
    """Raises ConfigError."""
    said = load_setting(path, "knee", KEYS)
    atmosphere_pa = 101325.0
    seconds = said.quantity("seconds", "s", 2.0 * FADE_S, 3600.0)
    asked = Knee(
        path.stem,
        said.file("rig"),
        said.pressures("spam", atmosphere_pa),
        said.pressures("ppam", atmosphere_pa),
        said.quantity("peak_to_peak", "rad", 1e-3, 1.0),
        said.quantity("from", "Hz", 0.05, 20.0),
        said.quantity("to", "Hz", 0.05, 20.0),
        seconds,
        said.pressures("catalogue_spam", atmosphere_pa),
        said.pressures("catalogue_ppam", atmosphere_pa),
        said.frequencies("catalogue_frequency"),
    )
    if not _edges(asked).size > 1:
        raise said.source.error(
            ("seconds",),
            f"{seconds:g} s",
            f"a chirp long enough for one whole period beside its fades ({FADE_S:g} s at each end)",
        )
    return asked


def _edges(asked: Knee) -> np.ndarray:
    """Turns of the chirp at which its whole periods begin and end, without those in which it
    fades.
    """
    t = np.array([FADE_S, asked.seconds - FADE_S])
    first, last = (asked.from_hz + 0.5 * (asked.to_hz - asked.from_hz) / asked.seconds * t) * t
    return np.arange(math.ceil(first), math.floor(last) + 1)


def experiment_text(asked: Knee, spam_pa: float, ppam_pa: float) -> str:
    """The experiment of one condition, for a rig with the muscles spam and ppam."""
    spam = {"set": f"{spam_pa / 1e3:.6g} kPa abs"}
    none = ppam_pa == NONE
    ppam = "vent" if none else {"set": f"{ppam_pa / 1e3:.6g} kPa abs"}

    def valves(word: str) -> dict:
        return {"spam": word, "ppam": "hold" if none else word}

    fill = {
        "loop": "motor_position",
        "valves": {"spam": spam, "ppam": ppam},
        "until": "valves_settled",
        "timeout": "60 s",
    }
    chirp = {
        "mean": "mean",
        "peak_to_peak": f"{math.degrees(asked.peak_to_peak_rad):.9g} deg",
        "from": f"{asked.from_hz:g} Hz",
        "to": f"{asked.to_hz:g} Hz",
        "fade": f"{FADE_S:g} s",
    }
    return yaml.safe_dump(
        {
            "experiment": "knee_condition",
            "loop": "joint_angle",
            "seed": 1,
            "description": (
                f"Knee chirp at SPAM {spam_pa / 1e3:.6g} kPa and PPAM"
                f" {'none' if none else f'{ppam_pa / 1e3:.6g} kPa'}"
            ),
            "before": [
                {
                    "name": "go_to_no_load",
                    "loop": "motor_position",
                    "move": {"to": "no_load", "speed": "20 mm/s"},
                },
                {"name": "fill", **fill},
                {
                    "name": "settle",
                    "loop": "motor_position",
                    "for": "3 s",
                    "valves": valves("hold_and_trim"),
                },
                {"name": "trim", **fill},
                {
                    "name": "go_to_mean",
                    "move": {"to": "mean", "speed": "10 deg/s"},
                    "valves": valves("hold"),
                },
                {"name": "rest_at_mean", "for": "2 s"},
            ],
            "phases": [
                {
                    "name": "trial",
                    "trial": True,
                    "chirp": chirp,
                    "for": f"{asked.seconds:g} s",
                    "valves": {"all": "hold"},
                }
            ],
            "after": [
                {"name": "rest", "for": "1 s"},
                {
                    "name": "return",
                    "loop": "motor_position",
                    "move": {"to": "no_load", "speed": "20 mm/s"},
                },
                {
                    "name": "vent",
                    "loop": "motor_position",
                    "valves": {"all": "vent"},
                    "until": "valves_settled",
                    "timeout": "60 s",
                },
            ],
        },
        sort_keys=False,
    )


def periods(asked: Knee, current_a: np.ndarray, angle_rad: np.ndarray, period_s: float) -> Periods:
    """Cuts a trial into the chirp's periods; those in which it fades are left out. ``current_a``,
    ``angle_rad``: (N,) from its start.
    """
    t = np.arange(len(current_a)) * period_s
    rate = (asked.to_hz - asked.from_hz) / asked.seconds
    turns = (asked.from_hz + 0.5 * rate * t) * t
    edges = np.searchsorted(turns, _edges(asked))
    rows = [
        (
            asked.from_hz + rate * 0.5 * (t[a] + t[min(b, len(t) - 1)]),
            float(np.sum(current_a[a:b] ** 2) * period_s),
            float(np.ptp(angle_rad[a:b])),
            float(np.abs(current_a[a:b]).max()),
        )
        for a, b in zip(edges[:-1], edges[1:], strict=True)
        if b < len(t)
    ]
    return (
        Periods(*(np.array(column) for column in zip(*rows, strict=True)))
        if rows
        else Periods(*(np.zeros(0),) * 4)
    )


def saved_ratio(with_ppam: Periods, without: Periods) -> np.ndarray:
    """Energy saved over that without parallel muscle, per period: (E0 - EP)/E0, positive where it
    saves (eq. 10 with its sign turned).
    """
    many = min(len(with_ppam.hz), len(without.hz))
    return 1.0 - with_ppam.energy_a2_s[:many] / without.energy_a2_s[:many]


def smooth(
    hz: np.ndarray, values: np.ndarray, width_hz: float = 0.1
) -> tuple[np.ndarray, np.ndarray]:
    """Means over bins of ``width_hz``: frequency and value, empty bins left out."""
    bins = np.floor(hz / width_hz).astype(int)
    kept = np.unique(bins)
    return np.array([hz[bins == b].mean() for b in kept]), np.array(
        [values[bins == b].mean() for b in kept]
    )
