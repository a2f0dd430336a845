"""The true plant of a case: what moves it, its parameters, and its readings over given commands."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.benchmark.oracle import Bench, averaged, clear_of_stops, noise_of
from epa_rt.models import plant as catalogue_physics
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from epa_rt.models.catalogue import NOMINAL, read_knob, write_knob
from sim_backend.stand_in import plant as stand_in
from sim_backend.stand_in.records import with_hidden

STEPS = {
    "motor_angle_rad": 2 * np.pi / 4096,
    "motor_speed_rad_s": 2 * np.pi / 60,
    "motor_current_a": 1e-3,
    "muscle0_gauge_pa": 1220.7,
    "muscle1_gauge_pa": 1220.7,
    "force_n": 0.2441,
    "joint_angle_rad": np.deg2rad(0.0195),
}
ORACLE_SUBSTEPS = 4
STOPS = {
    1.0: ("load_position_m", "low_m", "high_m", 1.5e-3),
    2.0: ("joint_angle_rad", "low_rad", "high_rad", 0.03),
}  # margins: gap/rig/house/judged.py
MOVE = 0.5  # standard deviations by which the oracle moves a nominal parameter


class TruePlant(NamedTuple):
    """``nominal``: (1,) PARAMS without any effect, as the rig really is; ``effects``: (name,
    strength fields) pairs.

    Hidden laws are fields of the stand-in. With ``same_law`` the effects are the catalogue's own
    (keys of knobs) and epa_rt.models moves the plant.
    """

    nominal: np.ndarray
    effects: tuple[tuple[str, Mapping[str, float]], ...] = ()
    same_law: bool = False

    @property
    def physics(self):
        return catalogue_physics if self.same_law else stand_in

    @property
    def substeps(self) -> int:
        return 2 if self.same_law else stand_in.SUBSTEPS

    @property
    def params(self) -> np.ndarray:
        if not self.same_law:
            return with_hidden(
                self.nominal,
                **{key: value for _, fields in self.effects for key, value in fields.items()},
            )
        params = self.nominal.copy()
        for _, fields in self.effects:
            for key, value in fields.items():
                write_knob(params, key, value)
        return params


def true_plant(believed: np.ndarray, truth: Mapping) -> TruePlant:
    """The plant of a sealed truth: ``believed`` (1,) PARAMS with its nominal parameters, its noise
    and its effects.
    """
    nominal = noisier(believed.copy(), truth["noise"])
    for key, value in truth["nominal"].items():
        write_knob(nominal, key, value)
    return TruePlant(
        nominal, tuple((e["name"], e["fields"]) for e in truth["effects"]), truth["same_law"]
    )


def noisier(params: np.ndarray, factor: float) -> np.ndarray:
    """Parameters with every sensor's noise times ``factor``; changed in place."""
    for name in params["sensors"].dtype.names:
        if "_noise_" in name:
            params["sensors"][name] *= factor
    return params


def channels_of(nominal: np.ndarray) -> tuple[str, ...]:
    """Channels that the rigs of this plant measure."""
    knee = nominal["load"]["kind_code"][0] == 2.0
    return tuple(
        name for name in STEPS if knee or name not in ("muscle1_gauge_pa", "joint_angle_rad")
    )


def readings(
    plant: TruePlant, commands: Sequence[np.ndarray], noisy: bool = False, exact: bool = False
) -> np.ndarray:
    """Averaged readings over all logs in a row, (n, channels); with ``noisy`` noise and converter
    steps are in them. ``exact``: integrated as logs are recorded, which readings of a log itself
    are held against (with half the steps a quiet knee is off by a chi-square of 220).
    """
    names, steps = (
        channels_of(plant.nominal),
        np.array([STEPS[name] for name in channels_of(plant.nominal)]),
    )
    parts = []
    for out in _outputs(plant, commands, noisy, exact):
        values = np.column_stack([out[name] for name in names])
        parts.append(averaged(np.floor(values / steps + 0.5) * steps if noisy else values))
    return np.concatenate(parts)


def judged_rows(plant: TruePlant, commands: Sequence[np.ndarray]) -> np.ndarray | None:
    """Rows (n,) bool of ``readings`` that count: those clear of the load's end stops. None where
    nothing can reach a stop: all count.
    """
    kind, load = float(plant.nominal["load"]["kind_code"][0]), plant.nominal["load"][0]
    if kind not in STOPS:
        return None
    place, low, high, margin = STOPS[kind]
    return np.concatenate(
        [
            clear_of_stops(averaged(out[place][:, None])[:, 0], load[low], load[high], margin)
            for out in _outputs(plant, commands)
        ]
    )


def _outputs(
    plant: TruePlant, commands: Sequence[np.ndarray], noisy: bool = False, exact: bool = False
) -> Iterator[np.ndarray]:
    """What the sensors read over each log, (N,) SENSORS."""
    params = plant.params.copy()
    if not noisy:
        for name in params["sensors"].dtype.names:
            if "_noise_" in name:
                params["sensors"][name] = 0.0
    from sim_backend.stand_in.replayed import run_again

    for i, log in enumerate(commands):
        params["sensors"]["seed"] = 77 + i
        yield run_again(
            params,
            log,
            1e-3,
            plant.substeps if plant.same_law or exact else ORACLE_SUBSTEPS,
            plant.physics,
        )


def bench_of(plant: TruePlant, commands: Sequence[np.ndarray]) -> Bench:
    """The oracle's bench around a plant without effects."""
    bare = plant._replace(effects=())
    base = readings(bare, commands)
    bench = Bench(
        base,
        noise_of(readings(bare, commands, noisy=True), base),
        np.zeros((0, 0)),
        judged_rows(bare, commands),
    )
    columns = []
    for item in competing(plant.nominal):
        moved = bare.nominal.copy()
        spread = max(item.relative * abs(read_knob(moved, item.key)), item.least)
        write_knob(moved, item.key, read_knob(moved, item.key) + MOVE * spread)
        columns.append(bench.white(readings(bare._replace(nominal=moved), commands)) / MOVE)
    return bench._replace(nominal=np.column_stack(columns))


def competing(nominal: np.ndarray) -> tuple:
    """Nominal parameters that this plant has."""
    kind = nominal["load"]["kind_code"][0]
    knee = (
        "load.mass_kg",
        "load.inertia_kg_m2",
        "load.mass_lever_m",
        "load.lever_m",
        "load.viscous_nm_s_rad",
    )
    mass = ("load.mass_kg", "load.viscous_n_s_m")
    return tuple(
        item
        for item in NOMINAL
        if not item.key.startswith("load.")
        or item.key in (knee if kind == 2.0 else mass if kind == 1.0 else ())
    )


def perturbed(nominal: np.ndarray, rng: np.random.Generator, most: float = 2.0) -> np.ndarray:
    """Nominal parameters off by their believed spread, normal and cut at ``most`` standard
    deviations.
    """
    out = nominal.copy()
    for item in competing(nominal):
        draw = rng.standard_normal()
        while abs(draw) > most:
            draw = rng.standard_normal()
        value = read_knob(out, item.key)
        write_knob(
            out,
            item.key,
            value + draw * max(item.relative * abs(value), item.least if value else 0.0),
        )
    write_knob(out, "drive.current_lag_s", max(read_knob(out, "drive.current_lag_s"), 2.5e-4))
    return out


def catalogue_fields(name: str, start: int, share: float) -> dict[str, float]:
    """Knobs of a catalogue effect, its strengths ``share`` of the way from neutral to a typical
    start.
    """
    from epa_rt.models.knobs import row_of

    effect = CATALOGUE[name]
    fields = {}
    for key, value in zip(effect.knobs, effect.starts[start], strict=True):
        _, row, _ = row_of(key)
        wanted = value if row.effect is None else row.neutral + share * (value - row.neutral)
        fields[key] = float(min(max(wanted, row.low), row.high))
    return fields
