"""What changed since healthy runs: wander is not named, a fault is, and runs that are no baseline
are refused.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from epa_rt.cli.gap.baseline import lacking
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.held_out.aside import split
from epa_rt.gap.likelihood.floor import floors
from epa_rt.gap.recording import Recording
from epa_rt.gap.report.traces import traces
from epa_rt.gap.rig.foreign import open_foreign
from epa_rt.gap.rig.foreign.healthy import (
    BOUND,
    Healthy,
    NotHealthy,
    healthy_from,
    levels_in,
    of_few,
    shapes_of,
)
from epa_rt.gap.rig.foreign.since import SinceBaseline
from epa_rt.gap.subject import OF_RUN
from tests.gap.foreign.made import RIGS, one_trial

PERIOD_S, MIDDLE_M = 5e-3, 0.123
MASS_KG, DRAG, COULOMB_N, OFFSET_N = 95.0, 205.0, 20.0, -3.0
LEVEL, NOISE_N = 0.03, 0.15  # of the friction from run to run; of the force


def run(
    seed: int, friction: float = 1.0, pace: float = 1.0, zero_n: float = 0.0, rise_n: float = 0.0
) -> Recording:
    """A carriage that repeats its strokes, with friction and offset of its own day. ``rise_n``: of
    its friction towards standstill.
    """
    random, t = np.random.default_rng(seed), np.arange(0.0, 8.0, PERIOD_S)
    size, start = 1.0 + 0.02 * random.standard_normal(), random.uniform(0.0, 6.0)
    w = 2.0 * np.pi * np.array([0.3, 0.9]) * pace
    wave = np.outer(w, t) + np.array([start, 2.0 * start])[:, None]
    reach = size * np.array([0.08, 0.02])[:, None]
    place = (reach * np.sin(wave)).sum(axis=0)
    speed = (reach * w[:, None] * np.cos(wave)).sum(axis=0)
    pull = -(reach * w[:, None] ** 2 * np.sin(wave)).sum(axis=0)
    level = friction * COULOMB_N * (1.0 + LEVEL * random.standard_normal())
    force = MASS_KG * pull + DRAG * speed + level * np.tanh(speed / 1e-3)
    force += rise_n * np.exp(-((speed / 0.02) ** 2)) * np.tanh(speed / 1e-3)
    force += OFFSET_N + zero_n + 0.3 * random.standard_normal()
    columns = {
        "carriage_position_m": MIDDLE_M + place,
        "motor_force_n": force + NOISE_N * random.standard_normal(len(t)),
    }
    return one_trial(f"run{seed}", "emps", PERIOD_S, columns)


@cache
def healthy() -> Healthy:
    return healthy_from(open_foreign(RIGS / "emps.yaml"), [run(seed) for seed in range(1, 11)])


def since(*logs: Recording):
    subject = SinceBaseline(healthy(), [log.name for log in logs])
    return diagnose(subject, list(logs), how_far=False), subject


def test_the_plant_becomes_that_of_the_healthy_runs():
    values = {q.key: q.values for q in healthy().quantities}
    level = values["friction.coulomb_n"]
    assert level.mean() == pytest.approx(COULOMB_N, rel=0.05)
    assert np.std(level, ddof=1) == pytest.approx(LEVEL * COULOMB_N, rel=0.7)
    assert values["carriage.inertia_kg"].mean() == pytest.approx(MASS_KG, rel=0.03)
    noise = np.nanstd(healthy().links["force"].noise)
    assert 0.3 * NOISE_N < noise < 3.0 * NOISE_N  # behind a low-pass of half the rate


def test_a_run_that_differs_as_healthy_ones_do_has_no_gap():
    log = run(50, friction=1.0 + LEVEL)  # one of six is as far off
    found, subject = since(log)
    assert found.verdict == "no_gap" and not found.effects, found.says
    assert all(abs(one.spreads) < 5.0 for one in subject.changes([log]))
    assert not any(one.name.startswith(OF_RUN) for one in found.nominal_moved)


def test_one_run_of_thirty_is_not_called_worn_with_confidence():
    found, _ = since(run(50, friction=1.0 + 2.0 * LEVEL))
    assert all(one.confidence < 0.8 for one in found.effects), found.says


def test_friction_that_has_grown_is_named_with_its_size():
    log = run(60, friction=1.4)
    found, subject = since(log)
    assert found.effects and found.effects[0].family == "friction", found.says
    level = next(one for one in subject.changes([log]) if one.name == "friction.coulomb_n")
    assert level.spreads > 5.0 and level.now == pytest.approx(1.4 * COULOMB_N, rel=0.12)


def test_numbers_that_cannot_be_are_said_and_stand_in_no_table():
    """A plant that lacks much of what every healthy run has."""
    there = healthy()
    level = next(q for q in there.quantities if q.key == "carriage.inertia_kg")
    assert not there.impossible("force")
    lost = replace(there, quantities=(replace(level, values=-level.values), *there.quantities[1:]))
    assert [q.key for q in lost.impossible("force")] == ["carriage.inertia_kg"]
    assert [one.name for one in SinceBaseline(lost).changes([run(50)])] == ["force as a whole"]
    assert "carriage.inertia_kg of -9" in lacking(lost) and not lacking(there)


def test_what_a_picture_begins_from_is_the_healthy_runs():
    subject, log = SinceBaseline(healthy()), run(60, friction=1.4)
    (left,) = traces(subject, [log], {}, {}, floors(subject, [log], {}))
    assert [words for words, kind, _ in left.lines if kind == "before"] == [
        "before, as in the healthy runs"
    ]


def test_of_a_log_that_no_fit_sees_the_level_is_taken_off_within_bounds():
    subject = SinceBaseline(healthy())
    usual, faulty = (
        float(np.nanstd(subject.residual(subject.prepare(one), {}, "force")))
        for one in (run(70), run(71, friction=1.6))
    )
    noise = float(np.nanstd(healthy().links["force"].noise))
    assert usual < 2.0 * noise and faulty > 5.0 * noise


@pytest.mark.parametrize("friction", [1.0, 1.02, 1.05])
def test_the_log_that_is_set_aside_has_no_level_of_its_own(friction):
    logs = [run(seed, friction=friction) for seed in (50, 150, 250)]
    fitted, _ = split(SinceBaseline(healthy()), logs)
    names = [one.name for one in fitted.only(logs)]
    again, _ = split(SinceBaseline(healthy(), names), logs)
    assert len(names) == 2 and [one.name for one in again.only(logs)] == names


def test_how_far_runs_differ_is_measured_and_bounds_what_one_more_may():
    subject = SinceBaseline(healthy(), ["one"])
    assert subject.usual.runs == 10 and 0.0 <= subject.usual.off["force"] < 0.3
    far = subject.nominal[0].high / subject.nominal[0].spread
    assert far == pytest.approx(BOUND * of_few(10)) and far > BOUND
    own = healthy().links["force"]
    shapes = shapes_of(subject.own, subject.own.prepare(run(3)), "force", own.levels) @ own.basis
    random = np.random.default_rng(0)
    level = random.standard_normal(shapes.shape[1])
    noise = own.floor.rms * 1e-3 * random.standard_normal(len(shapes))
    assert levels_in(shapes @ level + noise, shapes, own.floor) == pytest.approx(level, abs=0.1)


def test_a_level_of_any_law_that_wanders_in_healthy_runs_is_no_gap():
    runs = [run(seed, rise_n=3.0 * np.sin(seed)) for seed in range(1, 13)]
    one = healthy_from(open_foreign(RIGS / "emps.yaml"), runs)
    log = run(80, rise_n=2.5)
    found = diagnose(SinceBaseline(one, [log.name]), [log], how_far=False)
    assert not found.effects and found.verdict == "no_gap", found.says


def test_too_few_runs_and_other_motions_are_refused_in_a_sentence():
    subject = open_foreign(RIGS / "emps.yaml")
    with pytest.raises(NotHealthy, match="found 1 healthy run as a baseline, expected 3 or more"):
        healthy_from(subject, [run(1)])
    with pytest.raises(NotHealthy, match="run9: found speed_m_s .* as in the other runs"):
        healthy_from(subject, [run(1), run(2), run(3), run(9, pace=2.0)])
    with pytest.raises(NotHealthy, match="expected about .* as in the baseline"):
        healthy().check([run(9, pace=2.0)])


def test_a_patched_plant_is_one_without_the_levels_of_runs(tmp_path):
    log = run(60, friction=1.4)
    subject = SinceBaseline(healthy(), [log.name])
    values = {knob.key: 0.1 for knob in subject.nominal} | {"friction.coulomb_n": 28.0}
    text = subject.patched(values, ["coulomb", "viscous_changed"])
    (tmp_path / "plant.yaml").write_text(text, encoding="utf-8")
    plant = open_foreign(RIGS / "emps.yaml", tmp_path / "plant.yaml").plant
    assert plant.numbers["friction.coulomb_n"] == 28.0 and OF_RUN not in text
