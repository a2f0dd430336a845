"""The identified muscle as a plant file that the simulated rig runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from epa_rt.identify.data import Normalisation, Trial
from epa_rt.identify.physical import PhysicalFit
from epa_rt.identify.scores import Score
from epa_rt.models.knobs import write_knob
from epa_rt.models.plant_file import PlantFile, save_plant

POLYNOMIAL = 2.0
SWITCHED = {"slip_ratio": "braid_maxwell_slip", "end_length_m": "end_fittings", "bladder_stiffness_n_m": "bladder_spring",
            "lock_stiffness_n_m": "braid_lock"}


def polynomial_plant(plant: PlantFile, found: Score, norm: Normalisation, data: Sequence[Trial]) -> PlantFile:
    """The plant with eq. 8 as its muscle law, held inside the range that was identified."""
    params = plant.params.copy()
    write_knob(params, "muscle.law_code", POLYNOMIAL)
    for i, value in enumerate(found.coefficients.values(), start=1):
        write_knob(params, f"muscle.poly_c{i}_ratio", value)
    limits = {"poly_pressure_max_ratio": max(t.gauge_pa.max() for t in data) / norm.pressure_pa,
              "poly_length_max_ratio": (max(t.length_m.max() for t in data) - norm.no_load_m) / norm.length_m,
              "poly_speed_max_ratio": max(np.abs(t.speed_m_s).max() for t in data) / norm.speed_m_s}
    for name, value in limits.items():
        write_knob(params, f"muscle.{name}", float(value))
    return PlantFile(f"{plant.name}_polynomial", params, plant.substeps, plant.effects)


def physical_plant(plant: PlantFile, found: PhysicalFit) -> PlantFile:
    """The plant with the fitted numbers of the physical muscle, its effects named."""
    named = tuple(SWITCHED[key.split(".")[1]] for key in found.model.keys if key.split(".")[1] in SWITCHED)
    return PlantFile(f"{plant.name}_physical", found.params.copy(), plant.substeps, tuple(dict.fromkeys((*plant.effects, *named))))


def write(path: Path, plant: PlantFile) -> None:
    """Writes a plant file. Raises OSError."""
    save_plant(path, plant)
