"""Trials out of recordings: what is read, and in one sentence what is not."""

import dataclasses

import numpy as np
import pytest

from epa_rt.config.rig import load_rig
from epa_rt.gap.recording import Recording, Span
from epa_rt.identify.data import IdentifyError, remarks, trials
from epa_rt.models.plant_file import load_plant
from tests.identify.made import ATMOSPHERE_PA, ROOT, SLIP, made, motion, params

RIG = load_rig(ROOT / "config/rigs/bench.yaml")


@pytest.fixture
def recording():
    trial = made(params(SLIP), 1, 4.0)[0]
    columns = {
        "muscle_pressure_pa": trial.gauge_pa + ATMOSPHERE_PA,
        "muscle_force_n": trial.force_n,
        "motor_travel_m": trial.length_m - 0.12,
    }
    n = trial.samples
    return Recording(
        "log",
        "log.mcap",
        "bench",
        "",
        "",
        1e-3,
        np.arange(n),
        columns,
        (Span("fill", 0, 200, False), Span("trial", 200, n, True)),
    )


def changed(recording, name, values):
    return dataclasses.replace(recording, columns=recording.columns | {name: values})


def test_only_the_trial_is_read_and_pressure_is_gauge(recording):
    (found,) = trials([recording], RIG, params())
    assert found.samples == 3800 and found.length_m == pytest.approx(motion(4.0, 0)[200:])
    assert found.p0_pa == pytest.approx(
        recording.columns["muscle_pressure_pa"][200:250].mean() - ATMOSPHERE_PA, rel=1e-3
    )
    assert found.speed_m_s[20:-20] == pytest.approx(
        np.gradient(found.length_m, 1e-3)[20:-20], abs=4e-3
    )


def test_the_lag_of_the_pressure_sensor_is_taken_back(recording):
    from scipy.signal import lfilter

    true, keep = recording.columns["muscle_pressure_pa"], np.exp(-1e-3 / 5e-3)
    late = true[0] + lfilter([1.0 - keep], [1.0, -keep], true - true[0])
    believed = params()
    believed["sensors"]["pressure_lag_s"] = 5e-3
    back = (
        trials([changed(recording, "muscle_pressure_pa", late)], RIG, believed)[0].gauge_pa
        + ATMOSPHERE_PA
    )
    assert np.std(back - true[200:]) < 0.2 * np.std(late - true)


def test_what_is_missing_at_an_end_is_cut_off(recording):
    force = recording.columns["muscle_force_n"].copy()
    force[200:300] = np.nan
    assert trials([changed(recording, "muscle_force_n", force)], RIG, params())[0].samples == 3700


def hole(recording):
    force = recording.columns["muscle_force_n"].copy()
    force[1000] = np.nan
    return changed(recording, "muscle_force_n", force)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (hole, "no valid value at sample 800"),
        (lambda r: dataclasses.replace(r, spans=r.spans[:1]), "found no trial in log.mcap"),
        (
            lambda r: dataclasses.replace(r, spans=(Span("trial", 0, 300, True),)),
            "found 300 sound samples",
        ),
        (
            lambda r: dataclasses.replace(
                r, columns={k: v for k, v in r.columns.items() if k != "muscle_force_n"}
            ),
            "found no column muscle_force_n",
        ),
        (lambda r: changed(r, "motor_travel_m", np.zeros(r.samples)), "found a stroke of 0.00 mm"),
        (
            lambda r: changed(r, "motor_travel_m", np.linspace(0.0, 0.02, r.samples)),
            "motion that never comes back",
        ),
    ],
    ids=("hole", "no trial", "short", "no force", "no stroke", "one way"),
)
def test_what_cannot_be_read_is_one_sentence(recording, spoil, words):
    with pytest.raises(IdentifyError, match=words) as caught:
        trials([spoil(recording)], RIG, params())
    assert "expected" in str(caught.value) and "\n" not in str(caught.value)


def test_a_rig_without_a_force_signal_is_refused(recording):
    blind = RIG.model_copy(
        update={"signals": tuple(row for row in RIG.signals if row.port != "force_n")}
    )
    with pytest.raises(IdentifyError, match="has no muscle with force"):
        trials([recording], blind, params())


@pytest.mark.parametrize("plant", ["knee", "mass"])
def test_a_load_that_moves_the_muscle_is_refused(recording, plant):
    with pytest.raises(IdentifyError, match="a plant file whose load moves the muscle as well"):
        trials([recording], RIG, load_plant(ROOT / f"config/plants/{plant}.yaml").params)


def test_few_blocks_are_said(recording):
    found = trials([recording], RIG, params())
    assert any("4 s of trials are 2 blocks of 2 s" in said for said in remarks(found))
    assert not any("blocks" in said for said in remarks(found * 15))
