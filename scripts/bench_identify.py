"""Recovery and coverage of the identification, as JSON: known numbers from clean trials, and how
often 95 % intervals hold them.

Trials are synthesised with the plant's own muscle; the motion and the noise differ from repeat to
repeat. The noise is white (2.4 N) plus 1.5 N with a memory of 0.1 s. "white" beside the coverage is
that of intervals which take every sample for its own.

  python scripts/bench_identify.py [REPEATS]
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from epa_rt.identify.data import normalisation, pressures
from epa_rt.identify.linear import scaled, sums
from epa_rt.identify.models import BY_NAME, POLYNOMIAL
from epa_rt.identify.physical import MODELS, fit_physical
from epa_rt.identify.scores import score
from epa_rt.models.knobs import read_knob
from tests.identify.made import EQ8, SLIP, made, params

TRIALS, SECONDS, NOISE_N, DRIFT_N = 3, 30.0, 2.4, 1.5
HELD = {
    "muscle0.braid_turns_ratio": 2.9,
    "muscle0.viscous_n_s_m": 20.0,
    "muscle0.slip_ratio": 0.05,
    "muscle0.end_length_m": 0.8e-3,
    "muscle0.bladder_stiffness_n_m": 300.0,
    "muscle0.lock_stiffness_n_m": 15e3,
    "muscle0.lock_length_m": 0.144,
}
BELIEVED = {"muscle0.viscous_n_s_m": 5.0, "muscle0.braid_turns_ratio": 3.3}


def polynomial(trials):
    """Coefficients, intervals, and half widths of intervals for white noise."""
    norm, model = normalisation(params()), BY_NAME[POLYNOMIAL]
    data = sums(model, [scaled(trial, norm, 0.2078, 3.05) for trial in trials], 1e-3)
    found = score(model, data, pressures(trials), norm, "none")[1]
    white = (
        1.96 * found.rms_n / norm.force_n * np.sqrt(np.diag(np.linalg.inv(data.matrix.sum(axis=0))))
    )
    return list(found.coefficients.values()), list(found.intervals.values()), white


def physical(model):
    def fitted(trials):
        found = fit_physical(model, params(BELIEVED), trials, pressures(trials), "none").score
        return (
            list(found.coefficients.values()),
            list(found.intervals.values()),
            np.full(len(found.coefficients), np.nan),
        )

    return fitted


def told(name, truth, keys, fitted, repeats):
    """Largest error on clean trials and coverage by number."""
    real = params(truth)
    values = np.array([read_knob(real, key) for key in keys])
    clean = np.array(fitted(made(real, TRIALS, SECONDS))[0])
    inside, white = np.zeros(len(keys)), np.zeros(len(keys))
    for seed in range(repeats):
        found, intervals, width = fitted(made(real, TRIALS, SECONDS, NOISE_N, DRIFT_N, seed + 1))
        inside += [low <= v <= high for v, (low, high) in zip(values, intervals, strict=True)]
        white += np.abs(np.array(found) - values) <= width
    print(f"{name}: done", file=sys.stderr)
    return {
        "clean_error_percent": dict(
            zip(keys, np.round(100.0 * np.abs(clean / values - 1.0), 3).tolist(), strict=True)
        ),
        "held_percent": dict(
            zip(keys, np.round(100.0 * inside / repeats, 1).tolist(), strict=True)
        ),
        **(
            {"held_percent_white": np.round(100.0 * white / repeats, 1).tolist()}
            if np.any(white)
            else {}
        ),
    }


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    answer = {
        "repeats": repeats,
        "trials": TRIALS,
        "seconds_each": SECONDS,
        "noise_n": NOISE_N,
        "drift_n": DRIFT_N,
        "polynomial": told(
            "polynomial",
            EQ8,
            [f"muscle0.poly_c{i}_ratio" for i in range(1, 6)],
            polynomial,
            repeats,
        ),
    }
    for model, truth in ((MODELS[0], SLIP), (MODELS[1], HELD)):
        answer[model.name] = told(model.name, truth, model.keys, physical(model), repeats)
    print(json.dumps(answer, indent=1))


if __name__ == "__main__":
    main()
