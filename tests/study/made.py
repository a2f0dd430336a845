"""Plants for tests of studies."""

import functools
from pathlib import Path

import numpy as np

from epa_rt.models.plant_file import load_plant
from epa_rt.study.motion import Drive
from epa_rt.study.serial import at_point

ROOT = Path(__file__).resolve().parents[2]
SERIAL = ROOT / "config/plants/serial.yaml"
ATMOSPHERE_PA = 101325.0


def linear(stiffness_n_m: float, damping_n_s_m: float) -> np.ndarray:
    """The serial plant with a muscle that is a spring and a damper, whatever its pressure."""
    params = load_plant(SERIAL).params
    muscle = params["muscle"][0, 0]
    for name, value in {
        "law_code": 2.0,
        "poly_c1_ratio": 1.0,
        "poly_c2_ratio": 0.0,
        "poly_c3_ratio": 0.0,
        "poly_c4_ratio": 0.0,
        "poly_c5_ratio": 0.0,
        "poly_force_n": stiffness_n_m * 0.03,
        "poly_pressure_pa": 1e5,
        "poly_pressure_max_ratio": 1.0,
        "poly_length_m": 0.03,
        "poly_length_max_ratio": 10.0,
        "viscous_n_s_m": damping_n_s_m,
        "slip_ratio": 0.0,
        "lock_stiffness_n_m": 0.0,
        "lock_viscous_n_s_m": 0.0,
    }.items():
        muscle[name] = value
    return params


def task(params: np.ndarray):
    """The serial study's task at 1 cm."""
    return functools.partial(at_point, params, 0.0, 0.01, Drive())
