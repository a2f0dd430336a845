"""The oracle's distances on the knee: nothing is taken from the end stop, and nominal parameters
hide what they can.
"""

from pathlib import Path

import numpy as np
import pytest

from epa_rt.benchmark.oracle import LIMIT, Bench, distance
from epa_rt.cli.gap.blind.make import _record
from epa_rt.config.rig import load_rig
from epa_rt.gap.rig.house.judged import STOP_MARGIN
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend
from sim_backend.stand_in import truth
from sim_backend.stand_in.distances import Apart
from sim_backend.stand_in.effects import BY_NAME
from sim_backend.stand_in.fitted import law_of
from sim_backend.stand_in.replayed import commands_of

CONFIG = Path(__file__).resolve().parents[3] / "config"


@pytest.fixture(scope="module")
def knee() -> tuple[truth.TruePlant, list[np.ndarray], Bench]:
    """Plant, commands of one short log and the oracle's bench."""
    rig, believed = (
        load_rig(CONFIG / "rigs" / "knee.yaml"),
        load_plant(CONFIG / "plants" / "knee.yaml"),
    )
    _, outputs = _record(
        CONFIG / "experiments" / "knee_chirp_short.yaml",
        CONFIG / "rigs" / "knee.yaml",
        CONFIG / "plants" / "knee.yaml",
        SimBackend(rig, believed, 1),
        None,
    )
    plant, commands = truth.TruePlant(believed.params), [commands_of(rig, outputs)]
    return plant, commands, truth.bench_of(plant, commands)


def seen(knee, name: str, **fields: float) -> np.ndarray:
    return truth.readings(knee[0]._replace(effects=((name, fields),)), knee[1])


def test_margins_are_the_diagnosis_own():
    assert {kind: row[3] for kind, row in truth.STOPS.items()} == STOP_MARGIN


def test_nothing_counts_at_the_stop_and_on_the_bench_everything_does(knee):
    plant, commands, bench = knee
    joint, low = bench.base[:, -1], plant.nominal["load"]["low_rad"][0]
    assert joint[0] < low + 0.01  # every log of a knee begins there
    assert joint[bench.judged].min() > low + 0.03
    moving = np.abs(joint) < np.deg2rad(6.0)  # rest at the mean and the trial
    assert bench.judged[400:][moving[400:]].mean() > 0.95
    only_there = bench.base.copy()
    only_there[~bench.judged, -1] += 0.01
    assert np.linalg.norm(bench._replace(judged=None).white(only_there)) > 10.0 * LIMIT
    assert distance(bench, only_there) == 0.0
    held = load_plant(CONFIG / "plants" / "bench.yaml").params
    assert truth.judged_rows(truth.TruePlant(held), commands) is None


def test_a_joint_offset_is_not_seen_by_the_stop_it_rests_on(knee, monkeypatch):
    plant, commands, bench = knee
    monkeypatch.setattr(truth, "judged_rows", lambda *_: None)
    everything, offset = (
        truth.bench_of(plant, commands),
        seen(knee, "joint_zero", joint_offset_rad=0.002),
    )
    assert distance(everything, offset) > 3.0 * LIMIT
    assert distance(bench, offset) < LIMIT


def test_a_payload_that_is_only_a_changed_mass_is_hardly_seen(knee):
    plant, commands, bench = knee
    loaded = seen(knee, "cuff", payload_kg=0.07, payload_lever_m=0.2)
    assert np.linalg.norm(bench.white(loaded)) > 50.0 * LIMIT
    apart = Apart(plant, bench, commands, loaded)
    assert apart.distance <= apart.linear
    assert apart.distance < 0.7 * LIMIT


def test_what_nominal_parameters_cannot_imitate_stays_and_its_own_law_explains_it(knee):
    plant, commands, bench = knee
    apart = Apart(
        plant, bench, commands, seen(knee, "knee_rubs", knee_dry_nm=0.02, knee_dry_rad_s=0.02)
    )
    assert 0.6 * apart.linear < apart.distance <= apart.linear
    assert apart.distance > 4.0 * LIMIT
    assert (
        apart.beside(law_of("knee_rubs", {"knee_dry_nm": 0.015, "knee_dry_rad_s": 0.03}))
        < 0.2 * apart.distance
    )
    rivals = apart.rivals(("knee_bristles",), fitted=True)
    assert rivals["knee_bristles"] <= min(apart.distance, apart.shown)


def test_a_rival_stays_within_what_it_may_be(knee):
    """A payload is never negative: one that the rig lost is not explained by it."""
    plant, commands, bench = knee
    stronger = seen(knee, "tilt", tilt_rad=0.05)
    for sign in (1.0, -1.0):
        apart = Apart(
            plant, bench, commands, bench.base + sign * (stronger - bench.base), fitted=False
        )
        _, _, strength = apart._linear(BY_NAME["cuff"])
        assert 0.0 <= strength <= BY_NAME["cuff"].most
        assert apart.rivals(("cuff",), fitted=False)["cuff"] <= apart.distance + 1e-9
