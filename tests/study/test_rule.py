"""Maps, the rule they give, and the experiment that the rule gives; study files with errors."""

import dataclasses

import numpy as np
import pytest

from epa_rt.config.rig import load_rig
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.experiments.experiment import experiment_from
from epa_rt.study.claims import serial_claims
from epa_rt.study.motion import NAMES
from epa_rt.study.rule import Rule, experiment_text, load_rule, rule_of, rule_text
from epa_rt.study.serial import Maps, load_serial
from tests.study.made import ROOT

STUDY = ROOT / "config/studies/serial.yaml"


def maps(**changed):
    """Maps whose stroke and power are least on a line that rises with frequency."""
    asked = load_serial(STUDY)
    shape = (len(asked.frequency_rad_s), len(asked.pressure_pa))
    of = {name: np.ones(shape) for name in NAMES}
    best = np.clip(10.0 * asked.frequency_rad_s, 100.0, 1000.0) * 1e3
    of["stroke_m"] = of["peak_power_w"] = 1e-3 + 1e-8 * np.abs(
        asked.pressure_pa[None, :] - best[:, None]
    )
    of["motion_m"], of["runaway_s"] = np.full(shape, 0.02), np.zeros(shape)
    return Maps(asked, of | changed)


def test_the_best_pressure_is_among_those_that_follow():
    slack = np.full((19, 19), 0.02)
    slack[12, :15] = 0.01  # at 80 rad/s nothing below 850 kPa follows
    assert maps().best_pressure_pa("stroke_m")[12] == pytest.approx(800e3)
    assert maps(motion_m=slack).best_pressure_pa("stroke_m")[12] == pytest.approx(850e3)


def test_no_pressure_is_best_where_nothing_follows():
    nothing = np.full((19, 19), 0.02)
    nothing[3] = np.nan
    found = maps(motion_m=nothing)
    assert np.isnan(found.best_pressure_pa("stroke_m")[3])
    assert len(rule_of(found, "stroke").frequency_rad_s) == 18


def test_a_rule_comes_back_from_its_file(tmp_path):
    rule = rule_of(maps(), "power")
    path = tmp_path / "rule.yaml"
    path.write_text(rule_text(rule, "serial"), encoding="utf-8")
    back = load_rule(path)
    assert back.goal == "power"
    np.testing.assert_allclose(back.pressure_pa, rule.pressure_pa)
    assert back.at(82.5) == pytest.approx(825e3)


def test_its_experiment_suits_the_mass_rig():
    rule = Rule("stroke", 0.015, 0.01, np.array([15.0, 30.0]), np.array([600e3, 800e3]))
    rig = load_rig(ROOT / "config/rigs/mass.yaml")
    text = experiment_text(rule, 22.5, 5.0)
    assert "700 kPa abs" in text
    assert experiment_from(parse_yaml(text, "made.yaml"), rig).duration_s > 5.0
    with pytest.raises(ValueError, match="where the rule holds"):
        experiment_text(rule, 31.0, 5.0)


def test_claims_can_fail():
    good = {c.claim: c.holds for c in serial_claims(maps(), {})}
    turned = maps()
    turned.of["stroke_m"] = turned.of["peak_power_w"] = turned.of["stroke_m"][::-1]
    bad = {c.claim: c.holds for c in serial_claims(turned, {})}
    rises = next(claim for claim in good if "valley" in claim)
    least = next(claim for claim in good if "near 800" in claim)
    assert good[rises] and good[least]
    assert not bad[rises] and not bad[least]


def test_one_pressure_and_none_that_follows_have_their_words():
    good = maps()
    one = Maps(
        dataclasses.replace(good.asked, pressure_pa=np.array([800e3])),
        {name: figure[:, 14:15] for name, figure in good.of.items()},
    )
    assert any("800 kPa (the only one tried)" in claim.ours for claim in serial_claims(one, {}))
    none = serial_claims(maps(motion_m=np.full((19, 19), np.nan)), {})
    assert [(claim.holds, claim.ours) for claim in none] == [
        (False, "at no pressure and frequency of this study")
    ]


def test_claims_are_of_the_plant_and_the_pid_they_name():
    good = maps()
    asked = dataclasses.replace(
        good.asked,
        drive=dataclasses.replace(good.asked.drive, pid=(20.0, 50.0, 0.12)),
        plant=dataclasses.replace(good.asked.plant, name="other"),
    )
    found = serial_claims(Maps(asked, good.of), {"serial_eq8": good, "other muscle": good})
    assert not any("The PID" in claim.claim for claim in found)
    assert [claim.claim for claim in found if claim.why] == [
        "Eq. (8) simulates the serial actuator (serial_eq8)"
    ]


@pytest.mark.parametrize(
    ("plant", "said"),
    [("knee", "whose load is no mass"), ("serial", "a second plant named 'serial'")],
)
def test_a_plant_beside_must_be_another_mass(tmp_path, plant, said):
    path = tmp_path / "serial.yaml"
    path.write_text(
        STUDY.read_text(encoding="utf-8")
        .replace("../plants/serial_eq8_no_c3.yaml", f"../plants/{plant}.yaml")
        .replace("../plants", str(ROOT / "config/plants")),
        encoding="utf-8",
    )
    with pytest.raises(ConfigError, match=said):
        load_serial(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("100 kPa abs", "100 kPa", "says what it is against"),
        ("points: 19", "points: 1", "a whole number from 2"),
        ("study: serial", "study: knee", "study: serial"),
        ("20 rad/s", "20 m", "rad/s"),
        ("amplitude: 10 mm", "amplitude: 10 m", "0.0001 to 0.1 m"),
        ("mean: 0 mm", "means: 0 mm", "'means'"),
        ("../plants/serial.yaml", "../plants/none.yaml", "study.yaml:4: plant: found no such file"),
        ("../plants/serial_eq8.yaml", "none.yaml", "study.yaml:5: beside[0]: found no such file"),
        ("../plants/serial.yaml", "../plants/knee.yaml", "kind_code: 1"),
    ],
)
def test_a_bad_study_file_is_one_sentence(old, new, said, tmp_path):
    text = STUDY.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "study.yaml"
    text = text.replace(old, new, 1)
    path.write_text(text.replace("../plants", str(ROOT / "config/plants")), encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        load_serial(path)
    assert said in str(error.value) and "\n" not in str(error.value)
