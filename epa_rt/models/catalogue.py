"""The catalogue of effects: what a rig may have that its nominal plant leaves out, and what
competes with it.

A family holds laws of which a rig has one at most. Strengths are middles of engineering ranges;
docs/effects.md lists all.
"""

from pathlib import Path

import numpy as np

from epa_rt.config.source import ConfigError
from epa_rt.models.beside import ADDED
from epa_rt.models.catalogue_chain import CHAIN
from epa_rt.models.catalogue_muscle import GAS_EFFECTS, MUSCLE_EFFECTS
from epa_rt.models.catalogue_sensors import SENSOR_EFFECTS
from epa_rt.models.effect import Effect, Knob
from epa_rt.models.knobs import (
    Nominal,
    effect_spread,
    read_knob,
    row_of,
    without_muscle,
    write_knob,
)
from epa_rt.models.parameters import rows

__all__ = [
    "BY_NAME",
    "CATALOGUE",
    "NOMINAL",
    "Nominal",
    "effects_of",
    "knob",
    "read_knob",
    "write_knob",
]

CATALOGUE: tuple[Effect, ...] = (
    *(*CHAIN, *GAS_EFFECTS, *MUSCLE_EFFECTS, *SENSOR_EFFECTS),
    *(one.effect for one in ADDED),
)
BY_NAME: dict[str, Effect] = {effect.name: effect for effect in CATALOGUE}
for _names in ([one.name for one in CATALOGUE], [f"{b}.{row.name}" for b, row in rows()]):
    if len(set(_names)) < len(_names):
        _twice = next(name for name in _names if _names.count(name) > 1)
        raise ConfigError(Path(__file__).parent / "added", 1, "", f"'{_twice}' twice", "it once")

NOMINAL: tuple[Nominal, ...] = (
    Nominal("drive.torque_constant_nm_a", 0.02),
    Nominal("drive.inertia_kg_m2", 0.05),
    Nominal("drive.viscous_nm_s_rad", 0.30, 3e-7),
    Nominal("drive.coulomb_nm", 0.20, 2e-4),
    Nominal("drive.current_lag_s", 0.20),
    Nominal("sensors.motor_torque_gain_ratio", 0.02),
    Nominal("gas.dead_volume_m3", 0.10),
    Nominal("gas.inlet_conductance_m3_s_pa", 0.05),
    Nominal("gas.exhaust_conductance_m3_s_pa", 0.05),
    Nominal("gas.supply_gauge_pa", 0.01),
    Nominal("gas.valve_lag_s", 0.20),
    Nominal("muscle.braid_length_m", 0.003),
    Nominal("muscle.braid_turns_ratio", 0.02),
    Nominal("muscle.viscous_n_s_m", 0.10, 0.1),
    Nominal("load.mass_kg", 0.02),
    Nominal("load.inertia_kg_m2", 0.03),
    Nominal("load.mass_lever_m", 0.02),
    Nominal("load.lever_m", 0.01),
    Nominal("load.viscous_n_s_m", 0.20, 0.2),
    Nominal("load.viscous_nm_s_rad", 0.20, 2e-3),
    Nominal("sensors.pressure_lag_s", 0.20, 5e-4),
)
_NOMINAL = {nominal.key: nominal for nominal in NOMINAL}


def effects_of(key: str) -> tuple[Effect, ...]:
    """Effects whose fit may move this number."""
    plain = without_muscle(key)
    return tuple(effect for effect in CATALOGUE if plain in effect.knobs)


def knob(key: str, params: np.ndarray) -> Knob:
    """The Knob of a key over a plant's ``params`` (shape (1,), PARAMS).

    Raises KeyError for a key that is neither nominal (NOMINAL) nor a knob of an effect.
    """
    _, row, _ = row_of(key)
    plain, value = without_muscle(key), read_knob(params, key)
    if plain in _NOMINAL:
        nominal = _NOMINAL[plain]
        return Knob(
            key,
            row.unit,
            value,
            row.low,
            row.high,
            max(nominal.relative * abs(value), nominal.least),
        )
    for effect in effects_of(key):
        return Knob(
            key,
            row.unit,
            value,
            row.low,
            row.high,
            effect_spread(effect, plain, row.neutral),
            effect.name,
            row.neutral,
        )
    raise KeyError(
        f"found '{key}', expected a nominal parameter that competes or a knob of an effect"
    )
