"""The knee study's arithmetic on signals that are known, its experiment, its claims, and the
catalogue's optimum.
"""

import dataclasses

import numpy as np
import pytest

from epa_rt.config.rig import load_rig
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.experiments.experiment import experiment_from
from epa_rt.models.plant_file import load_plant
from epa_rt.study.knee import (
    NONE,
    Periods,
    experiment_text,
    load_knee,
    periods,
    saved_ratio,
    smooth,
)
from epa_rt.study.knee_claims import catalogue_claims, knee_claims
from epa_rt.study.knee_study import Catalogue, Conditions, at_setting
from tests.study.made import ROOT

STUDY = ROOT / "config/studies/knee.yaml"


@pytest.fixture(scope="module")
def asked():
    return dataclasses.replace(load_knee(STUDY), seconds=40.0)


def chirp(asked, period_s=1e-3):
    t = np.arange(round(asked.seconds / period_s)) * period_s
    return np.sin(
        2.0 * np.pi * (asked.from_hz + 0.5 * (asked.to_hz - asked.from_hz) / asked.seconds * t) * t
    )


def test_periods_of_a_known_chirp(asked):
    wave = chirp(asked)
    found = periods(asked, 3.0 * wave, 0.1 * wave, 1e-3)
    np.testing.assert_allclose(
        found.energy_a2_s, 4.5 / found.hz, rtol=0.01
    )  # I^2 of a sine of 3 A is 4.5 A^2 in the mean
    np.testing.assert_allclose(found.swing_rad, 0.2, rtol=1e-3)
    assert 0.5 < found.hz[0] < 0.7 and 1.9 < found.hz[-1] < 2.0
    assert len(found.hz) == pytest.approx(
        50.0 - 4.8, abs=2.0
    )  # turns of the whole chirp, less the fades


def test_a_trial_that_is_cut_short_gives_fewer_periods(asked):
    wave = chirp(asked)[:20_000]
    assert 0 < len(periods(asked, wave, wave, 1e-3).hz) < 20
    assert len(periods(asked, wave[:10], wave[:10], 1e-3).hz) == 0


def test_saved_is_positive():
    none, some = (
        Periods(np.ones(3), energy, np.ones(3), np.ones(3))
        for energy in (np.array([2.0, 2.0, 2.0]), np.array([1.0, 2.0, 3.0]))
    )
    np.testing.assert_allclose(saved_ratio(some, none), [0.5, 0.0, -0.5])


def test_smooth_is_a_mean_per_bin():
    hz, values = smooth(np.array([0.51, 0.55, 0.71]), np.array([1.0, 3.0, 7.0]))
    np.testing.assert_allclose(hz, [0.53, 0.71])
    np.testing.assert_allclose(values, [2.0, 7.0])


@pytest.mark.parametrize("ppam_pa", [NONE, 170e3])
def test_every_condition_is_an_experiment_of_the_rig(asked, ppam_pa):
    text = experiment_text(asked, 185e3, ppam_pa)
    assert ("170 kPa abs" in text) == (ppam_pa != NONE)
    assert experiment_from(parse_yaml(text, "made.yaml"), load_rig(asked.rig)).duration_s > 40.0


def conditions(asked, energy):
    """Nine conditions with ``energy(spam, ppam, hz)``."""
    hz = np.linspace(0.55, 1.95, 60)
    return Conditions(
        asked,
        {
            (s, p): Periods(hz, energy(s, p, hz), np.full(60, asked.peak_to_peak_rad), np.ones(60))
            for s, p in asked.conditions
        },
    )


def test_claims_as_in_the_paper(asked):
    def energy(spam, ppam, hz):
        return {
            NONE: 1.0 + 0.0 * hz,
            145e3: 0.5 + 0.0 * hz,
            170e3: 0.5 + 0.2 * (hz - 1.5) if spam == 185e3 else 0.6 + 0.0 * hz,
        }[ppam]

    found = conditions(asked, energy)
    assert found.crossings_hz(185e3) == pytest.approx([1.5], abs=0.05)
    assert [claim.holds for claim in knee_claims(found)] == [True] * 5


def test_claims_that_fail(asked):
    found = conditions(
        asked, lambda spam, ppam, hz: {NONE: 1.0, 145e3: 1.1, 170e3: 0.6}[ppam] + 0.0 * hz
    )
    assert [claim.holds for claim in knee_claims(found)] == [False, False, False, False, True]


def test_fixed_setting_costs_what_it_costs(asked):
    small = dataclasses.replace(
        asked,
        catalogue_spam_pa=np.array([2e5]),
        catalogue_ppam_pa=np.array([1.4e5, 1.7e5]),
        catalogue_rad_s=2.0 * np.pi * np.array([1.0, 2.0]),
    )
    energy = np.array([[[1.0, 3.0]], [[1.0, 0.25]]])  # per period; mean I^2 is 1, 3 and 2, 0.5
    found = Catalogue(
        small,
        {"energy_a2_s": energy, "motion_m": np.full((2, 1, 2), 0.01), "wanted_m": np.array(0.01)},
    )
    assert [one[1:] for one in found.best()] == [(1.4e5, 1.0), (1.7e5, 0.5)]
    assert found.fixed()[1] == 1.4e5
    assert "100.0 % more" in catalogue_claims(found)[0].ours
    slack = Catalogue(small, found.of | {"motion_m": np.array([[[0.001, 0.01]], [[0.01, 0.01]]])})
    assert slack.best()[0][1] == 1.7e5


def test_more_support_takes_less_current():
    params = load_plant(ROOT / "config/plants/knee.yaml").params
    less, more = (at_setting(params, 0.005, (225e3, p, 6.0)) for p in (110e3, 160e3))
    assert more["energy_a2_s"] < 0.7 * less["energy_a2_s"]
    assert more["motion_m"] == pytest.approx(0.01, rel=0.03)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("185 kPa abs,", "185 kPa,", "says what it is against"),
        ("seconds: 5 min", "seconds: 1 s", "4 to 3600 s"),
        ("seconds: 5 min", "seconds: 4.5 s", "one whole period"),
        ("rig: ../rigs/knee.yaml", "rig: 3", "the name of a file"),
        ("rig: ../rigs/knee.yaml", "rig: none.yaml", "knee.yaml:4: rig: found no such file"),
    ],
)
def test_a_bad_study_file_is_one_sentence(old, new, said, tmp_path):
    text = STUDY.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "knee.yaml"
    text = text.replace(old, new, 1).replace("../rigs", str(ROOT / "config/rigs"))
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=said):
        load_knee(path)


def test_on_the_slower_gear_the_pressures_change_places():
    """Fig. 9's statement: more pressure saves more at low frequency and less at high, and both
    always save.
    """
    params = load_plant(ROOT / "config/plants/knee_geared.yaml").params
    energy = np.array(
        [
            [
                at_setting(params, 0.005, (185e3, p, 2.0 * np.pi * hz))["energy_a2_s"]
                for hz in (1.0, 2.0)
            ]
            for p in (101325.0, 145e3, 170e3)
        ]
    )
    saved = 1.0 - energy[1:] / energy[0]
    assert (saved > 0.0).all()
    assert saved[1, 0] > saved[0, 0] and saved[1, 1] < saved[0, 1]


def test_equal_motion_tells_a_crossing_from_none(asked):
    from epa_rt.study.knee_claims import equal_motion_claims
    from epa_rt.study.knee_study import EqualMotion

    rising = np.linspace(-0.2, 0.2, len(asked.catalogue_rad_s))

    def made(high):
        return EqualMotion(
            asked,
            {
                (s, p): 1.0 - {NONE: 0.0 * rising, 145e3: 0.3 + 0.0 * rising, 170e3: high}[p]
                for s, p in asked.conditions
            },
            np.ones(1),
        )

    assert [claim.holds for claim in equal_motion_claims(made(0.3 - rising))] == [True, True]
    assert "cross at 1.25 Hz" in equal_motion_claims(made(0.3 - rising))[1].ours
    assert [claim.holds for claim in equal_motion_claims(made(0.4 + 0.0 * rising))] == [True, False]
    assert equal_motion_claims(made(-0.1 - rising))[0].holds is False
    apart = equal_motion_claims(
        dataclasses.replace(made(0.3 - rising), motion_ratio=np.array([0.02, 1.31]))
    )
    assert [(claim.holds, claim.ours) for claim in apart] == [
        (None, "no equal motion: 2 to 131 % of the wanted swing")
    ]


def test_one_parallel_pressure_has_no_order(asked):
    alone = dataclasses.replace(asked, ppam_pa=np.array([145e3]))
    found = conditions(alone, lambda spam, ppam, hz: {NONE: 1.0, 145e3: 0.6}[ppam] + 0.0 * hz)
    assert [claim.claim[:20] for claim in knee_claims(found)] == [
        "For a fixed SPAM the",
        "The movement pattern",
    ]


def test_the_price_of_keeping_off_the_edge(asked):
    small = dataclasses.replace(
        asked,
        catalogue_spam_pa=np.array([1e5, 2e5, 3e5]),
        catalogue_ppam_pa=np.array([1.4e5]),
        catalogue_rad_s=2.0 * np.pi * np.array([1.0, 2.0]),
    )
    energy = np.array([[[1.0], [1.5], [3.0]], [[2.0], [0.5], [0.9]]])
    found = Catalogue(
        small,
        {
            "energy_a2_s": energy,
            "motion_m": np.full(energy.shape, 0.01),
            "wanted_m": np.array(0.01),
        },
    )
    assert "one inside it takes 0.0 to 50.0 % more" in catalogue_claims(found)[0].why
