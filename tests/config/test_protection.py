"""A rig file that does not protect is refused, a sentence for each finding; a reason excuses it."""

import json
import re
from pathlib import Path

import pytest
import yaml
from broken_files import RIGS, ROOT

from epa_rt.cli.main import main
from epa_rt.cli.sound_rig import sound_rig
from epa_rt.config.rig_protection import RULES
from epa_rt.config.source import ConfigError, load_yaml, parse_yaml

CASES = ROOT.parent / "shared/cases/rigs"
PLANTS = RIGS.parent / "plants"


def rules_broken(text: str, name: str = "rig.yaml") -> list[str]:
    """Names of the rules that a rig file breaks, or places that its schema or a controller refuses,
    in order.
    """
    try:
        sound_rig(parse_yaml(text, name))
    except ConfigError as error:
        for one in error.errors:
            said = str(one)
            assert said.isprintable() and said.startswith(f"{name}:{one.line}: "), said
            assert ": found " in said and ", expected " in said, said
        return [re.sub(r".*\brule (\w+)\)?", r"\1", one.where) for one in error.errors]
    return []


FORCE = "    limits: [-40 N, 350 N]\n"
TRAVEL = "calibration: {native: [0 count, 77824 count], value: [0 mm, 62.83185307 mm]}"
SPEED = "calibration: {native: [0 rpm, 1140 rpm], value: [0 mm/s, 62.83185307 mm/s]}"
I2T = "  i2t: {current: motor_current_a, continuous: 4.06 A, time_constant: 3.96 s}\n"
SUPPLY = "{supply: 850 kPa gauge}"
MOST = "    pressure_max: 780 kPa gauge\n"
DRIVE = "rated_torque: 170 mNm}"


def started(sdo: str) -> str:
    """The drive's line with one start-up object."""
    return DRIVE.replace("}", f", startup: [{sdo}]}}")


START = "drive, device: EPOS4, counts_per_turn: 4096"
# rule, rig, what becomes what
VARIANTS = [
    ("limits", "bench", FORCE, ""),
    ("limits", "bench", "    limits: [-150 mm/s, 150 mm/s]\n", ""),
    ("limits", "knee", "    limits: [-12 A, 12 A]\n", ""),
    ("within_sensor", "bench", "[-40 N, 350 N]", "[-40 N, 500 N]"),
    ("within_sensor", "bench_analog", "[-9 A, 9 A]", "[-10 A, 10 A]"),
    ("within_sensor", "bench", "[60 kPa abs, 800 kPa gauge]", "[10 kPa abs, 800 kPa gauge]"),
    ("range_used", "bench", "value: [0 N, 500 N]", "value: [0 N, 500 kN]"),
    ("range_used", "bench", "value: [0 kPa, 1000 kPa]", "value: [0 kPa, 1000 MPa]"),
    ("range_used", "bench_analog", "value: [0 A, 10 A]", "value: [0 A, 100 A]"),
    ("range_used", "knee", "value: [-40 deg, 40 deg]", "value: [-40 rad, 40 rad]"),
    ("drive_units", "bench", "value: [0 A, 1 A]", "value: [0 A, 1000 A]"),
    ("drive_units", "bench", "value: [0 mNm, 170 mNm]", "value: [0 mNm, 170 Nm]"),
    ("at_rest", "bench", "[60 kPa abs, 800 kPa gauge]", "[60 kPa gauge, 800 kPa gauge]"),
    ("at_rest", "bench", "[-40 N, 350 N]", "[10 N, 350 N]"),
    ("valid", "bench", "    valid: [-0.8 V, 9.8 V]\n", ""),
    ("valid", "bench", "valid: [-0.8 V, 9.8 V]", "valid: [-0.8 V, 10 V]"),
    ("valid", "bench", "valid: [0.7 V, 5.2 V]", "valid: [-0.1 V, 5.2 V]"),
    ("stale_after", "bench", "    stale_after: 20\n", ""),
    ("stale_after", "bench", "stale_after: 20", "stale_after: 101"),
    ("slew", "bench", "    slew: 3 m/s^2\n", ""),
    ("slew", "bench", "    slew: 10 Nm/s\n", ""),
    ("command_in_measured", "bench", "[-80 mm/s, 80 mm/s]", "[-160 mm/s, 80 mm/s]"),
    ("command_in_measured", "bench", "slew: 150 mm/s", "slew: 151 mm/s"),
    ("command_in_measured", "bench", "speed_max: 70 mm/s", "speed_max: 151 mm/s"),
    ("reach", "bench", "[-10 mm, 31 mm]", "[-10 mm, 80 mm]"),
    ("reach", "bench_analog", "[-10 mm, 31 mm]", "[-1 m, 1 m]"),
    ("reach", "bench", "[-150 mm/s, 150 mm/s]", "[-150 mm/s, 350 mm/s]"),
    ("reach", "bench", "[-80 mm/s, 80 mm/s]", "[-80 mm/s, 281 mm/s]"),
    ("reach", "bench", "[-9 A, 9 A]", "[-9 A, 30 A]"),
    ("motor_measured", "bench", "  speed: motor_speed_m_s\n", ""),
    ("motor_measured", "bench", "  current: motor_current_a\n", ""),
    ("pressure_rises", "bench", "{native: [1 V, 5 V]", "{native: [5 V, 1 V]"),
    ("scale", "bench", TRAVEL, TRAVEL.replace("77824", "65536")),
    ("scale", "bench", SPEED, SPEED.replace("1140", "-1140")),
    ("scale", "bench", "counts_per_turn: 4096", "counts_per_turn: 2048"),
    ("scale", "bench_analog", "speed_per_volt: 250 rpm/V", "speed_per_volt: 500 rpm/V"),
    ("same_zero", "bench", TRAVEL, TRAVEL.replace("[0 mm, 62.83185307", "[1 mm, 63.83185307")),
    ("muscle_length", "bench", "[-10 mm, 31 mm]", "[-10 m, 31 m]"),
    ("muscle_length", "bench", "[-10 mm, 31 mm]", "[-10 mm, 88 mm]"),
    ("muscle_length", "bench", "[-10 mm, 31 mm]", "[-120 mm, 31 mm]"),
    ("muscle_length", "knee", "[-35 deg, 38 deg]", "[-3500 deg, 3800 deg]"),
    ("i2t", "bench", I2T, ""),
    ("following_error", "bench", "  following_error: 4 mm\n", ""),
    ("following_error", "bench", "following_error: 4 mm", "following_error: 21 mm"),
    ("joint_following_error", "knee", "  following_error: 4 deg\n", ""),
    ("without_power", "bench", ", inverted: true, safe: 1}", "}"),
    ("without_power", "knee", "muscle1_inlet}", "muscle1_inlet, inverted: true, safe: 1}"),
    ("pressures", "bench", SUPPLY, "{supply: 700 kPa gauge}"),
    ("pressures", "bench", SUPPLY, "{tolerance: 90 kPa, drift: 300 kPa}"),
    ("pressures", "knee", MOST, "    pressure_max: 90 kPa abs\n"),
    ("atmosphere", "bench", "101.325 kPa abs", "48 kPa abs"),
    ("atmosphere", "bench", "101.325 kPa abs", "112 kPa abs"),
    ("startup", "bench", DRIVE, started("{object: 0x6065:00, type: u32, value: 4294967295}")),
    ("startup", "bench", DRIVE, started("{object: 0x6007:00, type: i16, value: 0}")),
    ("startup", "bench", DRIVE, started("{object: 0x605A:00, type: i16, value: 0}")),
    ("startup", "bench", DRIVE, started("{object: 0x607D:02, type: i32, value: 2147483647}")),
    ("startup", "bench", DRIVE, started("{object: 0x6080:00, type: u32, value: 4294967295}")),
    ("plant", "bench", "../plants/bench.yaml", "../../../etc/passwd"),
    ("plant", "bench", "../plants/bench.yaml", "../../plants/bench.yaml"),
    ("plant", "bench", "../plants/bench.yaml", "/etc/passwd"),
    ("reaction", "bench", "reaction: 20 ms", "reaction: 101 ms"),
    ("reaction", "bench", "reaction: 20 ms", "reaction: 9 ms"),
    ("reaction", "bench", "lost_cycles: 3", "lost_cycles: 3\n  watchdog: 251 ms"),
    ("reaction", "bench", "overrun: {", "master: {frame_timeout: 7 ms}\noverrun: {"),
    ("drive_times", "bench", "transition_timeout: 0.5 s", "transition_timeout: 6 s"),
    ("drive_times", "bench_analog", "enable_delay: 0.1 s", "enable_delay: 6 s"),
    ("overrun", "bench", "late: 0.3 ms", "late: 1 ms"),
    ("overrun", "bench", "policy: count, in_a_row: 20", "policy: trip, in_a_row: 101"),
]


ALSO = {  # what else such a mistake breaks
    "reach": {"muscle_length", "command_in_measured"},
    "muscle_length": {"within_sensor"},
}


@pytest.mark.parametrize(("rule", "rig", "old", "new"), VARIANTS)
def test_a_rule_names_what_breaks_it(rule, rig, old, new):
    sound = (RIGS / f"{rig}.yaml").read_text(encoding="utf-8")
    assert old in sound
    # a command has the limits of what measures it
    broken = rules_broken(sound.replace(old, new, -1 if rule == "muscle_length" else 1))
    assert rule in broken, broken
    also = ALSO.get(rule, set())
    assert set(broken) <= {rule, "at_rest", "muscles[0].pressure_max", *also}, broken


@pytest.mark.parametrize("rule", ["EL3004", "EL4034"])
def test_a_terminals_start_up_objects_may_not_change_what_its_numbers_mean(rule):
    name = {"EL3004": "analog_in", "EL4034": "analog_out"}[rule]
    objects = ["0x8000:01, type: u8, value: 1", "0x8010:02, type: u8, value: 1"]
    if rule == "EL4034":
        objects.append("0x8020:05, type: u8, value: 2")
    sound = (RIGS / "bench.yaml").read_text(encoding="utf-8")
    old = f"{{name: {name}, device: {rule}}}"
    for text in objects:
        new = old.replace("}", f", startup: [{{object: {text}}}]}}")
        assert rules_broken(sound.replace(old, new)) == ["startup"], text
    kept = old.replace("}", ", startup: [{object: 0x8000:06, type: u8, value: 0}]}")
    assert rules_broken(sound.replace(old, kept)) == []


def test_every_rule_has_a_variant():
    covered = {rule for rule, *_ in VARIANTS} | {"safety"}
    assert {rule.name for rule in RULES} == covered


def test_the_operators_page_has_every_rule():
    page = (ROOT / "docs/rig-rules.md").read_text(encoding="utf-8")
    for rule in RULES:
        assert f"| {rule.name} | {rule.needs} |\n" in page, rule.name


def test_sections_left_out():
    data = yaml.safe_load((RIGS / "bench.yaml").read_text(encoding="utf-8"))
    del data["safety"], data["motor"]["zero"]
    assert sorted(rules_broken(yaml.safe_dump(data))) == ["i2t", "safety"]
    data["motor"]["zero"] = {"method": "here", "at": "40 mm"}
    assert sorted(rules_broken(yaml.safe_dump(data))) == ["motor.zero.at"]


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.yaml")), ids=lambda p: p.stem)
def test_delivered_rigs_are_sound_and_excuse_nothing(path):
    assert sound_rig(load_yaml(path)).unprotected == ()


@pytest.mark.parametrize(
    ("valves", "place"),
    [
        ("drift: 1 kPa", "valves.drift"),
        ("pulse_min: 0.9 s, pulse_max: 0.01 s", "valves.pulse_min"),
        ("settle: 20 s", "valves.settle"),
        ("supply: 50 kPa abs", "valves.supply"),
    ],
)
def test_what_a_valves_controller_refuses_is_a_sentence(valves, place, tmp_path, capsys):
    text = (RIGS / "bench.yaml").read_text(encoding="utf-8")
    text = text.replace("../plants", str(PLANTS))
    path = tmp_path / "bench.yaml"
    path.write_text(text.replace(SUPPLY, f"{{{valves}}}"), encoding="utf-8")
    experiment = ROOT / "config/experiments/identification_short.yaml"
    for words in (["check", path], ["run", experiment, "--rig", path, "-o", tmp_path / "out"]):
        assert main([str(word) for word in words]) == 2
        said = capsys.readouterr().err.splitlines()
        assert any(f"muscles[0].{place}" in line for line in said), said
        assert all(": found " in line and ", expected " in line for line in said)
    assert not (tmp_path / "out").exists()


def with_reasons(reasons: dict[str, str]) -> str:
    """bench.yaml without force limits, with reasons."""
    data = yaml.safe_load((RIGS / "bench.yaml").read_text(encoding="utf-8"))
    del data["signals"][1]["limits"]
    data["plant"] = str(PLANTS / "bench.yaml")
    return yaml.safe_dump(data | {"unprotected": reasons})


WHY = "the cell stands behind a mechanical stop"


@pytest.mark.parametrize("name", ["limits", "muscle_force_n"])
def test_a_reason_excuses_a_finding_by_its_rule_or_its_row(name):
    (said,) = sound_rig(parse_yaml(with_reasons({name: WHY}), "rig.yaml")).unprotected
    assert "muscle_force_n (rule limits)" in said and WHY in said


@pytest.mark.parametrize(
    ("reasons", "places"),
    [
        ({"limits": "no"}, ["unprotected.limits"]),
        ({"limits": "because"}, ["unprotected.limits"]),
        ({"limits": 3}, ["unprotected.limits"]),
        ({"limits": "one\ntwo three"}, ["unprotected.limits"]),
        ({"limits": "long " * 60}, ["unprotected.limits"]),
        ({"forces": WHY}, ["limits", "unprotected.forces"]),
        ({"limits": WHY, "i2t": WHY}, ["unprotected.i2t"]),
        ({"limits": WHY, "motor_travel_m": WHY}, ["unprotected.motor_travel_m"]),
        ({"limits": WHY, "plant": WHY}, ["unprotected.plant"]),
        ({}, ["limits"]),
    ],
)
def test_a_reason_that_is_none_is_refused(reasons, places):
    assert rules_broken(with_reasons(reasons)) == places


def test_check_and_run_say_what_is_unprotected_and_the_log_keeps_it(tmp_path, capsys):
    from epa_rt.logs.reader import LogReader

    path = tmp_path / "bench.yaml"
    path.write_text(with_reasons({"limits": WHY}), encoding="utf-8")
    (tmp_path / "short.yaml").write_text(
        "experiment: short\nloop: motor_speed\nphases: [{name: rest, for: 50 ms}]\n"
    )
    assert main(["check", str(path)]) == 0
    assert "UNPROTECTED: muscle_force_n (rule limits): found a force without limits" in (
        capsys.readouterr().out
    )
    log = tmp_path / "run.mcap"
    words = ["run", str(tmp_path / "short.yaml"), "--rig", str(path), "-o", str(log), "--quiet"]
    assert main(words) == 0
    assert WHY in capsys.readouterr().err
    with LogReader(log) as read:
        assert any(event.kind == "unprotected" and WHY in event.text for event in read.events())
        assert WHY in read.metadata["unprotected"]["0"]


def test_the_answers_as_json(tmp_path, capsys):
    path = tmp_path / "bench.yaml"
    path.write_text(with_reasons({}), encoding="utf-8")
    assert main(["check", "--json", str(path), str(RIGS / "bench.yaml")]) == 2
    captured = capsys.readouterr()
    broken, sound = json.loads(captured.out)
    assert captured.err == "" and not broken["sound"] and sound["sound"]
    (error,) = broken["errors"]
    assert error["where"] == "muscle_force_n (rule limits)" and error["line"] > 1
    assert "muscle_force_n: trips outside -40 to 350 N" in sound["protected"]


# What the shared inputs break.
SHARED = {
    "atmosphere_30_kpa": ["at_rest", "atmosphere"],
    "bus_EK1100_0x00100000": [],
    "bus_EPOS4_0x01800000": [],
    "cmd_speed_cal_sign_differs_from_measured": ["scale"],
    "cmd_speed_limits_exceed_measured_limits": ["command_in_measured", "reach"],
    "cmd_speed_slew_none": ["slew"],
    "exhaust_nc_safe_traps_the_air": ["without_power"],
    "following_error_removed": ["following_error"],
    "force_limits_beyond_sensor_5000_n": ["within_sensor"],
    "force_no_limits": ["limits"],
    "force_no_limits_no_valid_no_stale": ["limits", "valid", "stale_after"],
    "i2t_removed": ["i2t"],
    "inlet_no_safe_fills_the_muscle": ["without_power"],
    "joint_following_error_removed": ["joint_following_error"],
    "limits_low_abs_800_gauge_swapped_words": ["at_rest"],
    "motor_speed_removed": ["motor_measured"],
    "no_safety_section": ["safety", "i2t"],
    "other_EL2008": [],  # a terminal that is known
    "other_EL3064": ["signals[14].entry"],  # an analog input has no valves
    "other_ma": ["signals[0].calibration"],
    "overrun_late_1e6_s": ["overrun"],
    "plant_path_etc_passwd": ["plant"],
    "pressure_calibration_reversed": ["pressure_rises"],
    "pressure_no_valid": ["valid"],
    "reaction_1_s_lost_cycles_900_watchdog_100_ms": ["reaction"],
    "speed_row_limits_removed_contradiction_mute": ["limits"],
    "startup_disables_following_error_of_drive_0x6065": ["startup"],
    "supply_below_pressure_max": ["pressures"],
    "tolerance_1_mpa": ["pressures", "pressures"],
    "transition_timeout_3600_s": ["drive_times"],
    "travel_cal_sign_differs_from_cmd": ["scale"],
    "travel_limits_1_m": ["reach"],
    "valves_drift": ["muscles[0].valves.drift"],
    "valves_pulse": ["muscles[0].valves.pulse_min"],
    "valves_settle20": ["muscles[0].valves.settle"],
    "valves_supply_low": ["pressures", "muscles[0].valves.supply"],
    "watchdog_6_s": ["reaction"],
}


@pytest.mark.skipif(not CASES.is_dir(), reason="the shared inputs are not beside this repository")
@pytest.mark.parametrize("name", SHARED)
def test_the_shared_inputs(name):
    data = yaml.safe_load((CASES / f"{name}.yaml").read_text(encoding="utf-8"))
    assert rules_broken(yaml.safe_dump(data, sort_keys=False)) == SHARED[name]


@pytest.mark.skipif(not CASES.is_dir(), reason="the shared inputs are not beside this repository")
def test_every_shared_input_is_answered():
    assert {path.stem for path in Path(CASES).glob("*.yaml")} == set(SHARED)
