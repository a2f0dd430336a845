"""The identified muscle as a plant file that the simulated rig runs."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from epa_rt.identify.answer import Answer
from epa_rt.identify.data import Normalisation, Trial
from epa_rt.identify.gas import GasFit
from epa_rt.identify.models import POLYNOMIAL, SIGN_RAMP, TANG_ALL
from epa_rt.identify.physical import PhysicalFit
from epa_rt.identify.scores import Score
from epa_rt.models.knobs import read_knob, row_of, write_knob
from epa_rt.models.plant_file import PlantFile, save_plant

CHOICES = ("best", "polynomial", "tang", "physical")
MCKIBBEN, TANG, EQ8 = 0.0, 1.0, 2.0
SWITCHED = {
    "slip_ratio": "braid_maxwell_slip",
    "dahl_ratio": "braid_dahl",
    "end_length_m": "end_fittings",
    "bladder_stiffness_n_m": "bladder_spring",
    "lock_stiffness_n_m": "braid_lock",
}
FRICTION = (
    "slip_ratio",
    "dahl_ratio",
    "stribeck_ratio",
    "run_in_ratio",
    "lugre_ratio",
    "bouc_wen_ratio",
    "preisach_ratio",
    "coulomb_ratio",
    "pressure_viscous_s_m",
    "bladder_stiffness_n_m",
    "threshold_pa",
    "softening_per_pa",
    "end_length_m",
    "lock_stiffness_n_m",
    "lock_viscous_n_s_m",
    "viscous_n_s_m",
    "creep_stiffness_n_m",
)


def chosen_plant(
    choice: str, plant: PlantFile, found: Answer, data: Sequence[Trial]
) -> tuple[PlantFile, Score]:
    """The plant with the muscle of one model, and that model's score. ``choice``: one of CHOICES.
    Raises KeyError.
    """
    linear = {model.name: score for model, _, score in found.linear}
    physical = min(found.physical, key=lambda fit: _judged(fit.score), default=None)
    ways = {"polynomial": linear[POLYNOMIAL], "tang": linear[TANG_ALL]} | (
        {"physical": physical.score} if physical else {}
    )
    choice = min(ways, key=lambda name: _judged(ways[name])) if choice == "best" else choice
    plant = _with_gas(plant, found.gas)
    if choice == "physical" and physical is not None:
        return physical_plant(plant, physical), physical.score
    make = {"polynomial": polynomial_plant, "tang": tang_plant}[choice]
    return make(plant, ways[choice], found.normalisation, data), ways[choice]


def _with_gas(plant: PlantFile, gas: GasFit | None) -> PlantFile:
    """The plant with the identified exponent and leak, within what a plant file may have."""
    if gas is None:
        return plant
    params = plant.params.copy()
    for key, value in (
        ("gas0.polytropic_ratio", gas.polytropic_ratio),
        ("gas0.leak_per_s", gas.leak_per_s),
    ):
        row = row_of(key)[1]
        write_knob(params, key, float(np.clip(value, row.low, row.high)))
    return PlantFile(
        plant.name,
        params,
        plant.substeps,
        tuple(dict.fromkeys((*plant.effects, "polytropic", "leak"))),
    )


def _judged(score: Score) -> float:
    """RMS on trials left out; in sample where none could be."""
    return score.rms_trial_n if np.isfinite(score.rms_trial_n) else score.rms_n


def polynomial_plant(
    plant: PlantFile, found: Score, norm: Normalisation, data: Sequence[Trial]
) -> PlantFile:
    """The plant with eq. 8 as its muscle law, held inside the range that was identified."""
    params = _bare(plant, EQ8)
    for i, value in enumerate(found.coefficients.values(), start=1):
        write_knob(params, f"muscle0.poly_c{i}_ratio", value)
    limits = {
        "poly_pressure_max_ratio": max(t.gauge_pa.max() for t in data) / norm.pressure_pa,
        "poly_length_max_ratio": (
            (max(t.length_m.max() for t in data) - norm.no_load_m) / norm.length_m
        ),
        "poly_speed_max_ratio": max(np.abs(t.speed_m_s).max() for t in data) / norm.speed_m_s,
    }
    for name, value in limits.items():
        write_knob(params, f"muscle0.{name}", float(value))
    return _named(plant, "polynomial", params)


def tang_plant(
    plant: PlantFile, found: Score, norm: Normalisation, data: Sequence[Trial]
) -> PlantFile:
    """The plant with eqs. 4-7, all coefficients fitted, in SI."""
    params, fitted = (
        _bare(plant, TANG),
        {name.split()[0]: value for name, value in found.coefficients.items()},
    )
    p, x, v, f = norm.pressure_pa, norm.length_m, norm.speed_m_s, norm.force_n
    values = {
        "k0_m2": fitted["K0"] * f / p,
        "k1_m": fitted["K1"] * f / (p * x),
        "k2_ratio": fitted["K2"] * f / (p * x**2),
        "s0_n": fitted["S0"] * f,
        "s1_n_m": fitted["S1"] * f / x,
        "s2_n_m2": fitted["S2"] * f / x**2,
        "d1_n_s_m_pa": fitted["D1"] * f / (p * v),
        "d2_n_s2_m2_pa": fitted["D2"] * f / (p * v**2),
        "n0_m2": fitted["N0"] * f / p,
        "n1_m": fitted["N1"] * f / (p * x),
        "n2_ratio": fitted["N2"] * f / (p * x**2),
        "phi_pa": fitted["phi"] * p,
        "sign_m_s": SIGN_RAMP * v,
    }
    for name, value in values.items():
        write_knob(params, f"muscle0.tang_{name}", float(value))
    return _named(plant, "tang", params)


def physical_plant(plant: PlantFile, found: PhysicalFit) -> PlantFile:
    """The plant with the fitted numbers of the physical muscle, its effects named."""
    params = plant.params.copy()
    write_knob(params, "muscle0.law_code", MCKIBBEN)
    keys = [key for key in found.model.keys if key not in found.unseen]
    for key in keys:
        write_knob(params, key, read_knob(found.params, key))
    named = tuple(SWITCHED[key.split(".")[1]] for key in keys if key.split(".")[1] in SWITCHED)
    return PlantFile(
        f"{plant.name}_identified_physical",
        params,
        plant.substeps,
        tuple(dict.fromkeys((*plant.effects, *named))),
    )


def _bare(plant: PlantFile, law: float) -> np.ndarray:
    """The plant's numbers with another law, and without the muscle effects that this law stands
    for.
    """
    params = plant.params.copy()
    write_knob(params, "muscle0.law_code", law)
    for name in FRICTION:
        write_knob(params, f"muscle0.{name}", 0.0)
    return params


def _named(plant: PlantFile, word: str, params: np.ndarray) -> PlantFile:
    gone = {
        "braid_maxwell_slip",
        "braid_dahl",
        "braid_stribeck",
        "braid_run_in",
        "braid_lugre",
        "braid_bouc_wen",
        "braid_preisach",
        "braid_coulomb",
        "braid_pressure_viscous",
        "bladder_spring",
        "threshold_pressure",
        "pull_softening",
        "end_fittings",
        "braid_lock",
        "creep",
    }
    return PlantFile(
        f"{plant.name}_identified_{word}",
        params,
        plant.substeps,
        tuple(name for name in plant.effects if name not in gone),
    )


def plant_text(plant: PlantFile, remarks: Sequence[str]) -> str:
    """A plant file's text, headed by remarks."""
    with TemporaryDirectory(prefix="epa-identify-") as folder:
        path = Path(folder) / "plant.yaml"
        save_plant(path, plant)
        return "".join(f"# {' '.join(line.split())}\n" for line in remarks) + path.read_text(
            encoding="utf-8"
        )
