"""A case as it is made: through the whole loop, complete, and silent about its truth."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from epa_rt.benchmark.plans import plan_of
from epa_rt.cli.gap.blind.make import _one, _record
from epa_rt.cli.inputs import load_inputs
from epa_rt.config.rig import load_rig
from epa_rt.experiments.experiment import load_experiment
from epa_rt.gap.rig.read import read_recording
from epa_rt.logs.reader import LogReader
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from epa_rt.models.catalogue import NOMINAL, read_knob
from epa_rt.models.plant_file import load_plant
from sim_backend.stand_in import draw, effects, strengths
from sim_backend.stand_in.make import make_case
from sim_backend.stand_in.records import HIDDEN_FIELDS
from tests.loop.rigging import run_in_memory

CONFIG = Path(__file__).resolve().parents[2] / "config"
NEWEST = max(effects.IN_PLACE)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blind") / "case_000"
    spec = draw.Spec(0, "single", "bench", "short", 1.0, ("laminar_leak",), 10.0)
    return folder, make_case(1234567, spec, folder, CONFIG, _record)


def test_a_case_is_whole_and_its_effect_as_strong_as_asked(made):
    folder, truth = made
    told = json.loads((folder / "case.json").read_text())
    for place in (told["rig"], told["plant"], *told["logs"], *told["holdout"]):
        assert (folder / place).exists()
    for log in (*told["logs"], *told["holdout"]):
        recording = read_recording(folder / log)
        asked = load_experiment(
            folder / f"experiments/{Path(log).stem}.yaml", load_rig(folder / "rig.yaml")
        )
        assert not recording.found
        assert [span.name for span in recording.spans] == [phase.name for phase in asked.phases]
        trials = [(span.name, span.stop - span.start) for span in recording.spans if span.trial]
        assert trials and trials == [
            (phase.name, phase.cycles) for phase in asked.phases if phase.trial_index is not None
        ]
    assert truth["effects"][0]["multiple"] == pytest.approx(10.0, rel=0.3)
    assert truth["excited"]


def test_the_believed_plant_is_the_repositorys_and_the_true_one_is_off(made):
    folder, truth = made
    believed = load_plant(folder / "plant.yaml").params
    assert (folder / "plant.yaml").read_text() == (CONFIG / "plants" / "bench.yaml").read_text()
    spread = {item.key: item for item in NOMINAL}
    off = {key: value / read_knob(believed, key) - 1.0 for key, value in truth["nominal"].items()}
    assert all(off.values())
    assert all(abs(share) <= 2.0 * spread[key].relative + 1e-9 for key, share in off.items())


def test_neither_logs_nor_files_give_the_truth_away(made):
    """What a diagnosis could read in a case's folder: every file, every attachment, every unpacked
    message.
    """
    folder, truth = made
    words = {effects.BY_NAME[e["name"]].name.encode() for e in truth["effects"]} | {
        b"stand_in",
        b"stand-in",
        b"hidden",
        b"sealed",
        b"1234567",
    }
    words |= {name.encode() for name, _ in HIDDEN_FIELDS if len(name) > 9}
    numbers = [*truth["nominal"].values(), *truth["effects"][0]["fields"].values()]
    words |= {repr(value).encode() for value in numbers} | {
        struct.pack("<d", value) for value in numbers
    }
    for path in (p for p in folder.rglob("*") if p.is_file()):
        texts = [path.read_bytes()]
        if path.suffix == ".mcap":
            with LogReader(path) as log:
                texts += [
                    *log.attachments.values(),
                    json.dumps(log.metadata).encode(),
                    b"".join(rows.tobytes() for rows in log._store.rows()),
                    json.dumps(
                        [[e.kind, e.text, e.data] for e in log.events()], default=str
                    ).encode(),
                ]
                assert log.attachments["plant.yaml"] == (folder / "plant.yaml").read_bytes()
                assert log.metadata["run"]["seed"] == "0"
        for text in texts:
            assert not [word for word in words if word in text], path


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_every_experiment_of_a_case_completes_on_the_rig_as_its_files_have_it(rig, tmp_path):
    """The knee's third log moves it near its resonance: no check may take that for a fault."""
    plan = plan_of(rig, "rich", np.random.default_rng(3))
    for name, text in zip("bcd", (*plan.logs[1:], *plan.holdout), strict=True):
        (tmp_path / f"{name}.yaml").write_text(text)
        inputs = load_inputs(tmp_path / f"{name}.yaml", CONFIG / f"rigs/{rig}.yaml", None, True)
        outcome = run_in_memory(inputs)
        assert outcome.result.outcome == "completed", outcome.result.cause


def test_a_benchmark_has_every_kind_and_decoys():
    specs = draw.draw(5, 120)
    assert len(specs) == 120
    assert [s.index for s in specs] == list(range(120))
    counts = {kind: sum(s.kind == kind for s in specs) for kind in draw.KINDS}
    assert all(
        counts[kind] == pytest.approx(120 * share, abs=1.0) for kind, share in draw.SHARES.items()
    )
    assert {s.noise for s in specs} == set(draw.NOISE)
    assert 15 <= sum(s.rig == "knee" for s in specs) <= 60
    singles = sorted(s.multiple for s in specs if s.kind == "single")
    assert singles[0] < 0.8
    assert singles[-1] > 35.0
    assert draw.draw(5, 120) == specs != draw.draw(6, 120)


@pytest.mark.parametrize("laws", [2, 3, 4, 5])
def test_other_laws_are_the_same_cases_with_other_formulas(laws):
    first, second = draw.draw(5, 120), draw.draw(5, 120, laws=laws)
    others = {one: two.name for one, two in effects.IN_PLACE[laws].items()}
    moved = [s for s in second if s.kind != "same_law"]
    assert [s._replace(laws=1, effects=()) for s in second] == [
        s._replace(effects=()) for s in first
    ]
    assert [s.effects for s in moved] == [
        tuple(others.get(name, name) for name in s.effects) for s in first if s.kind != "same_law"
    ]
    assert {name for s in moved for name in s.effects} >= set(others.values())
    assert not {name for s in moved for name in s.effects} & set(others)
    assert [s.effects for s in second if s.kind == "same_law"] == [
        s.effects for s in first if s.kind == "same_law"
    ]


def test_what_is_withheld_is_its_whole_family():
    assert set(draw.left_out("laminar_leak")) == {
        name for name, e in CATALOGUE.items() if e.family == CATALOGUE["leak"].family
    }
    assert set(draw.left_out("slow_gauge")) == {"gauge_skew", "gauge_lag"}
    assert draw.left_out("windage") == []
    assert set(draw.left_out("gas_energy")) == {
        name for name, e in CATALOGUE.items() if e.family == CATALOGUE["gas_energy"].family
    }


def test_the_matrix_has_every_hidden_effect_and_every_other_of_the_catalogue():
    by_others, by_own = draw.one_of_each(), draw.one_of_the_others()
    assert len(by_others) == len(effects.EFFECTS)
    answered = {name for effect in effects.EFFECTS for name in effect.answers}
    assert answered | {spec.effects[0] for spec in by_own} >= set(CATALOGUE)
    assert not answered & {spec.effects[0] for spec in by_own}
    assert all(spec.own_law for spec in by_own) and not any(spec.own_law for spec in by_others)
    assert all(
        name in effects.BY_NAME[name].answers for name in set(effects.BY_NAME) & set(CATALOGUE)
    ), "one name for two things"


def test_each_alone_is_every_effect_with_a_name_on_every_rig_that_shows_it_by_the_newest_laws():
    specs = draw.each_alone(20.0, NEWEST)
    named = [effect for effect in effects.EFFECTS if draw.families(effect)]
    assert len(specs) == sum(len(effect.rigs) for effect in named) and [
        spec.index for spec in specs
    ] == list(range(len(specs)))
    assert {spec.effects[0] for spec in specs} == {
        effects.IN_PLACE[NEWEST].get(effect.name, effect).name for effect in named
    }
    assert {(spec.kind, spec.multiple, spec.plan, spec.laws) for spec in specs} == {
        ("single", 20.0, "rich", NEWEST)
    }
    assert not any(spec.own_law for spec in specs)


def test_of_each_alone_what_cannot_be_that_strong_is_made_half_as_strong(monkeypatch, tmp_path):
    asked = []

    def made(seed, spec, *places):
        asked.append(spec.multiple)
        if spec.multiple > 6.0:
            raise strengths.Unfit("too strong")
        return {"case": "case_000"}

    monkeypatch.setattr("sim_backend.stand_in.make.make_case", made)
    spec = draw.each_alone(20.0, NEWEST)[0]
    assert _one(1, spec, tmp_path, CONFIG, tmp_path, weaker=True)["redrawn"] == 2
    assert asked == [20.0, 10.0, 5.0]


def test_the_blocks_of_an_own_law_are_where_its_fault_shows():
    assert strengths._blocks(CATALOGUE["joint_skew"]) == ["sensors", "load"]
    assert strengths._blocks(CATALOGUE["motor_speed_gain"]) == ["sensors", "drive", "transmission"]
    assert strengths._blocks(CATALOGUE["motor_viscous_asymmetry"]) == ["drive", "transmission"]
    assert strengths._blocks(CATALOGUE["valve_stuck"]) == ["gas"]
