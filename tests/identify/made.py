"""Trials made without a run: random strokes, a sealed gas, the plant's own muscle for the force,
noise as asked.
"""

from functools import cache
from pathlib import Path

import numpy as np

from epa_rt.identify.data import Trial, trial_of
from epa_rt.models.blocks.muscle import NO_LOAD, muscle_over_log
from epa_rt.models.knobs import write_knob
from epa_rt.models.plant_file import PlantFile, load_plant

ROOT = Path(__file__).resolve().parents[2]
ATMOSPHERE_PA = 101325.0
PERIOD_S = 1e-3
SLIP = {"muscle0.slip_ratio": 0.04, "muscle0.viscous_n_s_m": 25.0, "muscle0.braid_turns_ratio": 2.9}
EQ8 = {
    "muscle0.law_code": 2.0,
    "muscle0.poly_c1_ratio": 1.6,
    "muscle0.poly_c2_ratio": -0.25,
    "muscle0.poly_c3_ratio": -0.03,
    "muscle0.poly_c4_ratio": 0.08,
    "muscle0.poly_c5_ratio": 0.3,
    "muscle0.viscous_n_s_m": 0.0,
}


@cache
def bench() -> PlantFile:
    return load_plant(ROOT / "config/plants/bench.yaml")


def params(changes: dict[str, float] | None = None) -> np.ndarray:
    """(1,) PARAMS of the bench with numbers changed."""
    found = bench().params.copy()
    for key, value in (changes or {}).items():
        write_knob(found, key, value)
    return found


def motion(seconds: float, seed: int) -> np.ndarray:
    """Length (m): straight strokes at random speeds between 1 and 27 mm past no-load length,
    rounded at the turns.
    """
    rng, length, at = np.random.default_rng(seed), [], 1e-3
    while len(length) < seconds / PERIOD_S:
        to, speed = rng.uniform(1e-3, 27e-3), rng.uniform(5e-3, 50e-3)
        length += np.linspace(at, to, max(int(abs(to - at) / speed / PERIOD_S), 2)).tolist() + [
            to
        ] * int(rng.uniform(50, 300))
        at = to
    kernel = np.hanning(41)
    path = np.pad(np.array(length[: int(seconds / PERIOD_S)]), 20, mode="edge")
    return 0.2078 * NO_LOAD + np.convolve(path, kernel / kernel.sum(), mode="valid")


def pressure(length: np.ndarray, p0_pa: float, exponent: float = 1.2) -> np.ndarray:
    """Gauge pressure (Pa) of gas shut in at the first length. Source: eqs. 2 and 3."""
    volume = (0.2078**2 - length**2) * length
    return (p0_pa + ATMOSPHERE_PA) * (volume[0] / volume) ** exponent - ATMOSPHERE_PA


def made(
    truth: np.ndarray,
    trials: int = 3,
    seconds: float = 20.0,
    noise_n: float = 0.0,
    drift_n: float = 0.0,
    seed: int = 0,
) -> list[Trial]:
    """Trials at so many no-load pressures; ``noise_n`` white, ``drift_n`` with a memory of 0.1 s,
    rms each.
    """
    rng, found = np.random.default_rng(seed + 1000), []
    for k, p0 in enumerate(np.linspace(460e3, 640e3, trials)):
        length = motion(seconds, 100 * seed + k)
        clean = trial_of(
            f"trial {k}",
            "made",
            PERIOD_S,
            pressure(length, p0),
            length,
            np.zeros(len(length)),
            ATMOSPHERE_PA,
        )
        force = muscle_over_log(truth, clean.gauge_pa, clean.length_m, clean.speed_m_s, 0, PERIOD_S)
        force = (
            force
            + noise_n * rng.standard_normal(len(length))
            + drift_n * _coloured(len(length), rng)
        )
        found.append(
            trial_of(
                f"trial {k}", "made", PERIOD_S, pressure(length, p0), length, force, ATMOSPHERE_PA
            )
        )
    return found


def _coloured(count: int, rng: np.random.Generator) -> np.ndarray:
    """Noise of rms 1 with a memory of 0.1 s."""
    from scipy.signal import lfilter

    keep = np.exp(-PERIOD_S / 0.1)
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(count))
