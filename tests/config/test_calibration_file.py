"""A rig reads by the calibration files that it names, and refuses what does not fit."""

import pytest
import yaml

from epa_rt.calibrate.calibration import as_file, calibrate
from epa_rt.calibrate.prior import reading_priors
from epa_rt.config.calibration_file import (
    CalibrationFile,
    read_calibrations,
    self_contained,
    write_calibrations,
)
from epa_rt.config.rig import load_rig, rig_from
from epa_rt.config.source import ConfigError, load_yaml, parse_yaml
from epa_rt.gap.rig.house.subject import HouseSubject
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder
from epa_rt.signals.image import image_of
from sim_backend.wiring import wire_analog_inputs
from tests.calibrate.made import SCALE, points
from tests.cli.shell import ROOT

ENTRY = "analog_in.ch2"


def made(gain=48.0, offset=-2.0, **more):
    words = {"kind": "force", "entry": ENTRY, "source": "rig", "when": "2026-11-27T12:00:00Z"}
    words |= {"operator": "J. D\N{LATIN SMALL LETTER O WITH DIAERESIS}", "serial": "7: #'", **more}
    return as_file(calibrate(points(gain, offset), SCALE), method="", **words)


@pytest.fixture
def rig(tmp_path):
    text = (ROOT / "config/rigs/bench.yaml").read_text()
    path = tmp_path / "bench.yaml"
    path.write_text(text.replace("rig: bench\n", "rig: bench\ncalibrations: [c.yaml]\n", 1))
    write_calibrations(
        tmp_path / "c.yaml", CalibrationFile(calibration_of="bench", signals=(made(),))
    )
    return path


def test_a_file_comes_back_as_it_was_written(rig):
    _, file = read_calibrations(rig.with_name("c.yaml"), "bench")
    before, after = made(), file.signals[0]
    for key in ("gain", "offset", "offset_uncertainty", "correlation", "reading_uncertainty"):
        assert getattr(after, key) == pytest.approx(getattr(before, key), rel=1e-8), key
    assert after.gain_uncertainty == pytest.approx(before.gain_uncertainty, rel=1e-3)
    assert (after.operator, after.serial, after.when) == (
        before.operator,
        before.serial,
        before.when,
    )
    assert [p.reference for p in after.fitted_points] == [p.reference for p in before.fitted_points]
    assert after.coverage_factor == pytest.approx(before.coverage_factor, abs=1e-6)


def test_readings_go_by_the_file_and_the_simulated_sensor_stays_as_it_is(rig):
    typed, plain = load_rig(rig), load_rig(ROOT / "config/rigs/bench.yaml")
    image = image_of(typed, outputs=False)
    raw = bytearray(image.size)
    place = image.places[ENTRY].byte
    raw[place : place + 2] = (3200).to_bytes(2, "little", signed=True)
    volts = 3200 * 10.0 / 32768.0
    line = typed.applied_calibrations[0]
    assert Decoder(typed).decode(bytes(raw))["muscle_force_n"] == pytest.approx(
        line.gain * volts + line.offset
    )
    assert Decoder(plain).decode(bytes(raw))["muscle_force_n"] == pytest.approx(50.0 * volts)
    assert (wire_analog_inputs(typed) == wire_analog_inputs(plain)).all()


def test_the_logs_copy_needs_no_file(rig):
    whole = self_contained(load_yaml(rig))
    rig.with_name("c.yaml").unlink()
    again = rig_from(parse_yaml(whole.text, "log[rig.yaml]"))
    assert again.applied_calibrations[0].gain == pytest.approx(made().gain, rel=1e-8)
    assert not again.applied_calibrations[0].points
    with pytest.raises(ConfigError, match="no such file"):
        load_rig(rig)


def test_the_prior_of_a_reading_is_its_calibration(rig):
    prior = reading_priors(load_rig(rig))
    one = made()
    assert set(prior) == {"muscle_force_n"}
    assert prior["muscle_force_n"].gain_ratio_std == pytest.approx(
        one.gain_uncertainty / one.gain, rel=1e-3
    )
    assert prior["muscle_force_n"].offset_std == pytest.approx(one.zero_uncertainty, rel=1e-2)
    assert reading_priors(load_rig(ROOT / "config/rigs/bench.yaml")) == {}
    knobs = HouseSubject(load_rig(rig), load_plant(ROOT / "config/plants/bench.yaml")).knobs
    stated = {key: knob.stated for key, knob in knobs.items() if knob.stated is not None}
    assert stated == {
        "sensors.force_gain_ratio": prior["muscle_force_n"].gain_ratio_std,
        "sensors.force_offset_n": prior["muscle_force_n"].offset_std,
    }


def change(rig, **changes):
    path = rig.with_name("c.yaml")
    data = yaml.safe_load(path.read_text())
    for key, value in changes.items():
        if key == "calibration_of":
            data[key] = value
        else:
            data["signals"][0][key] = value
    path.write_text(yaml.safe_dump(data, sort_keys=False))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"calibration_of": "knee"}, "c.yaml:1: calibration_of: found 'knee', expected 'bench'"),
        ({"signal": "knee_angle_rad"}, "gain: found"),
        ({"signal": "spam_force_n"}, "c.yaml:3: signals[0].signal: found 'spam_force_n'"),
        ({"entry": "analog_in.ch3"}, "c.yaml:6: signals[0].entry: found 'analog_in.ch3'"),
        ({"native": "mA"}, "found"),
        ({"gain": "150 N/V"}, "within a factor of 2"),
        ({"gain": "-48 N/V"}, "within a factor of 2"),
        ({"offset": "-300 N"}, "shifts its reading by"),
        ({"gain": "48 N"}, "gain: found '48 N'"),
        ({"gain": "0 N/V"}, "neither flat nor upright"),
        ({"gain": ".nan"}, "gain: found"),
        ({"gain_uncertainty": "-1 N/V"}, "zero or more"),
        ({"offset_uncertainty": "-1 N"}, "zero or more"),
        ({"correlation": 2.0}, "correlation"),
        ({"when": "yesterday"}, "expected a time"),
        ({"when": "2026-01-01T00:00:00"}, "expected a time"),
        ({"range": ["300 N", "0 N"]}, "lower end first"),
        ({"points": [{"reference": "3 N"}]}, "expected a point"),
        ({"points": 5}, "a list of points"),
        ({"colour": "red"}, "unknown key 'colour'"),
    ],
)
def test_what_does_not_fit_is_refused_with_file_and_line(rig, changes, says):
    change(rig, **changes)
    with pytest.raises(ConfigError) as caught:
        load_rig(rig)
    assert says in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("named", ["[a.txt]", "c.yaml", "[3]", "[absent.yaml]", "[c.yaml, c.yaml]"])
def test_a_rig_names_yaml_files_each_signal_once(rig, named):
    rig.write_text(rig.read_text().replace("[c.yaml]", named))
    with pytest.raises(ConfigError):
        load_rig(rig)


def test_the_drives_own_rows_are_not_calibrated(rig):
    with pytest.raises(ConfigError, match="expected a sensor at a terminal"):
        one = made().model_copy(
            update={"signal": "motor_travel_m", "entry": "drive.position", "native": "count"}
        )
        data = one.model_copy(update={"points": (), "gain": 8.07e-7})
        write_calibrations(
            rig.with_name("c.yaml"), CalibrationFile.model_construct(
                calibration_of="bench", signals=(data,)
            )
        )  # fmt: skip
        load_rig(rig)
