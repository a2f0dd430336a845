"""Rig and plant files of component rigs: one sentence with file, line, what was found and what was
expected.
"""

import re

import numpy as np
import pytest

from epa_rt.cli.gap.inputs import _of_plant_file
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.gap.rig.foreign import is_foreign, open_foreign
from epa_rt.gap.rig.foreign.plant_file import read_plant
from epa_rt.gap.rig.foreign.signals import Signals
from tests.gap.foreign.made import FILES, RIGS, subject_of

RIG = (RIGS / "emps.yaml").read_text(encoding="utf-8")
PLANT = (RIGS.parent / "plants_foreign/emps.yaml").read_text(encoding="utf-8")


def opened(tmp_path, rig=RIG, plant=PLANT, **more):
    (tmp_path / "rig.yaml").write_text(rig)
    (tmp_path / "plant.yaml").write_text(plant)
    return open_foreign(tmp_path / "rig.yaml", tmp_path / "plant.yaml", **more)


@pytest.mark.parametrize("path", sorted(RIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_rig_file_opens(path):
    subject = open_foreign(path)
    assert is_foreign(path) and subject.catalogue and subject.nominal
    for effect in subject.catalogue:
        for start in effect.starts:
            for key, value in zip(effect.knobs, start, strict=True):
                assert subject.knobs[key].low <= value <= subject.knobs[key].high, key


def test_a_rig_of_this_house_is_not_foreign():
    assert not is_foreign(RIGS.parent / "rigs/bench.yaml")


@pytest.mark.parametrize(
    ("text", "by", "found", "expected"),
    [
        ("kind: carriage", "kind: waggon", "'waggon'", "one of carriage, chamber, piston, servo"),
        ("stroke: 0.25 m", "stroke: 0.25 s", "'0.25 s'", "a quantity in m"),
        ("stroke: 0.25 m", "stroke: 0.25", "without a unit", "a unit like m"),
        ("  stroke: 0.25 m\n", "", "nothing", "the key 'stroke'"),
        ("stroke: 0.25 m", "strike: 0.25 m", "'strike'", "stroke"),
        ("force: motor_force_n", "power: motor_force_n", "'power'", "one of force, position"),
        (
            "force: motor_force_n",
            "force: carriage_position_m",
            "carriage_position_m for position and force",
            "a column each",
        ),
        ("lowpass: 50 Hz", "lowpass: 60 Hz", "60 Hz", "at most half the rate"),
        (
            "repeats_to: {force: 0.26 N}",
            "repeats_to: {force: 0.26 m}",
            "'0.26 m'",
            "a quantity in N",
        ),
    ],
)
def test_a_rig_file_that_does_not_fit(tmp_path, text, by, found, expected):
    assert text in RIG
    with pytest.raises(ConfigError) as error:
        opened(tmp_path, rig=RIG.replace(text, by))
    said = str(error.value)
    assert re.match(r".*rig\.yaml:\d+: ", said) and found in said and expected in said, said


@pytest.mark.parametrize(
    ("text", "by", "found", "expected"),
    [
        ("inertia: 95.2 kg", "inertia: 95.2 N", "'95.2 N'", "a quantity in kg"),
        ("inertia: 95.2 kg", "mass: 95.2 kg", "'mass'", "one of inertia"),
        ("viscous: 410 N*s/m", "viscous: -1 N*s/m", "-1", "0 to"),
        ("carriage: {inertia: 95.2 kg}\n", "", "nothing", "the key 'inertia'"),
        ("kind: carriage", "kind: chamber", "'chamber'", "carriage"),
        (
            "kind: carriage\ncarriage: {inertia",
            "kind: shaft\nshaft: {inertia",
            "'shaft'",
            "as the rig",
        ),
        ("plant: emps", "plant: emps\neffects: {sticktion: {}}", "'sticktion'", "one of"),
        ("plant: emps", "plant: emps\neffects: {coulomb: }", "found nothing", "a mapping"),
        ("kind: carriage", "kind:", "found nothing", "carriage"),
        (
            "plant: emps",
            "plant: emps\neffects: {coulomb: {coulomb: 9 Nm}}",
            "'9 Nm'",
            "a quantity in N",
        ),
    ],
)
def test_a_plant_file_that_does_not_fit(tmp_path, text, by, found, expected):
    assert text in PLANT
    with pytest.raises(ConfigError) as error:
        opened(tmp_path, plant=PLANT.replace(text, by))
    said = str(error.value)
    assert re.match(r".*plant\.yaml:\d+: ", said) and found in said and expected in said, said


@pytest.mark.parametrize(
    ("effects", "says"),
    [
        ("{coulomb: {coulomb: 9 N}, spring: {spring: 2 N}}", ()),
        ("{friction_over_place: {place_square: 2 N}, drive_gain: {gain: 1.1}}", ()),
        ("{coulomb: {}}", (":1: effects.coulomb: found an effect without strength",)),
        ("{stribeck: {stribeck_speed: 5 mm/s}}", ("its strength, 'stribeck', in N; as it stands",)),
        ("{drive_gain: {}}", ("its strength, 'gain'; as it stands it does nothing",)),
        (
            "{coulomb: {coulomb: 9 N}, dahl: {dahl: 3 N}}",
            (":1: effects.dahl: found coulomb and dahl, laws of one family (friction)",),
        ),
        ("{coulomb: {coulomb: 0 N}, dahl: {dahl: 3 N}}", ("effects.coulomb: found an effect",)),
    ],
)
def test_what_of_a_plant_file_may_not_be_meant_is_noted(tmp_path, effects, says):
    subject = opened(tmp_path, plant=f"effects: {effects}\n" + re.sub("effects: .*", "", PLANT))
    notes = subject.plant.notes
    assert len(notes) == len(says) and all(map(str.__contains__, notes, says)), notes
    assert tuple(one.says for one in _of_plant_file(subject)) == notes


def test_a_plant_file_that_is_not_there_is_told_where_the_rig_names_it(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.replace("../plants_foreign/emps.yaml", "none.yaml"))
    line = RIG[: RIG.index("plant:")].count("\n") + 1
    with pytest.raises(ConfigError, match=f"rig.yaml:{line}: plant: found no such file"):
        open_foreign(path)


def test_an_effect_that_is_left_out_is_in_neither_catalogue_nor_knobs(tmp_path):
    subject = opened(tmp_path, leave_out=frozenset({"coulomb"}))
    assert (
        "coulomb" not in [e.name for e in subject.catalogue]
        and "friction.coulomb_n" not in subject.knobs
    )
    with pytest.raises(ConfigError, match="no effect 'colomb'"):
        opened(tmp_path, leave_out=frozenset({"colomb"}))


@pytest.mark.parametrize("kind", FILES)
def test_a_patched_plant_reads_back_to_the_same_numbers(kind):
    subject = subject_of(kind)
    effect = subject.catalogue[0]
    values = {key: value / 3.0 for key, value in zip(effect.knobs, effect.starts[0], strict=True)}
    values[subject.nominal[0].key] = subject.nominal[0].value * 1.0123456789
    read = read_plant(parse_yaml(subject.patched(values, [effect.name]), "plant.yaml"), subject.rig)
    assert read.numbers == {**subject.plant.numbers, **values} and read.effects == (effect.name,)


def test_a_recording_without_a_column_says_so():
    from tests.gap.foreign.made import blank

    subject, recording = subject_of("carriage"), blank("carriage")
    del recording.columns["motor_force_n"]
    with pytest.raises(
        KeyError, match="found no column motor_force_n, expected what the rig file names"
    ):
        subject.prepare(recording)


def test_a_log_shorter_than_the_filter_reaches_has_nothing_settled():
    signals = Signals(
        "short", 1000.0, 5.0, 1, {"force": np.zeros(30)}, {"force": np.ones(30, bool)}, ()
    )
    assert signals.settled(np.ones(30, bool), 1.0).tolist() == [False] * 30
    long = Signals(
        "long", 1000.0, 50.0, 1, {"force": np.zeros(100)}, {"force": np.ones(100, bool)}, ()
    )
    assert np.flatnonzero(long.settled(np.ones(100, bool), 1.0)).tolist() == list(range(20, 80))
