"""How far: a rig whose answer is known, teacher-forced, in free run, and in what an operator asks
for.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.held_out.shrink import ALL, OVERALL, how_far_of, shrinkage
from epa_rt.gap.likelihood.alongside import best_pressure, channels, paired, step_of
from epa_rt.gap.likelihood.problem import Problem
from tests.gap.damper import NOISE_N, Damper, recorded, white_floor

TRUTH = {"muscle.coulomb_n": 1.0}
FLOORS = {"damper": white_floor()}


def row(rows, channel, mode, baseline="refitted", log=ALL):
    (found,) = [
        r for r in rows if (r.channel, r.mode, r.baseline, r.log) == (channel, mode, baseline, log)
    ]
    return found


@pytest.fixture(scope="module")
def rows():
    logs = [recorded(TRUTH, "a", 1), recorded(TRUTH, "b", 2)]
    return shrinkage(Damper(), logs, {"muscle.viscous_n_s_m": 8.0}, TRUTH, FLOORS)


def test_the_true_effect_closes_all_of_the_gap_in_both_modes(rows):
    for mode in ("teacher_forced", "free_run"):
        one = row(rows, "force_n", mode)
        assert (
            one.closed_share == pytest.approx(1.0, abs=0.02)
            and one.interval[0] <= 1.0 <= one.interval[1] + 0.01
        )
        assert one.times_floor == pytest.approx(1.0, abs=0.05) and one.floor == pytest.approx(
            NOISE_N, rel=0.05
        )
        assert one.unit == "N" and one.floor_source == "twin"


def test_before_is_told_for_the_refit_and_for_the_plant_file(rows):
    speed = recorded(TRUTH).columns["speed_m_s"]
    refitted = np.sqrt(np.mean((np.sign(speed) - 3.0 * speed) ** 2))
    assert row(rows, "force_n", "teacher_forced").before == pytest.approx(
        np.hypot(refitted, NOISE_N), rel=0.03
    )
    assert row(rows, "force_n", "teacher_forced", "plant_file").before == pytest.approx(
        np.hypot(1.0, NOISE_N), rel=0.03
    )


def test_what_noise_leaves_of_a_log_that_no_fit_has_seen_is_found_at_the_fitted_values():
    fitted, unseen = recorded(TRUTH, "a", 1), recorded(TRUTH, "b", 2)
    problem, asked = Problem(Damper(), [fitted], FLOORS), []

    def floors(subject, recordings, values, seed):
        asked.append(dict(values))
        return {"damper": replace(white_floor(), rms=3.0 * NOISE_N)}

    found = [
        how_far_of(Damper(), [log], problem, {}, TRUTH, floors, 0, lambda stage, share: None)
        for log in (fitted, unseen)
    ]
    assert asked == [TRUTH]
    assert [row(rows, "force_n", "teacher_forced").floor for rows in found] == pytest.approx(
        [NOISE_N, 3.0 * NOISE_N]
    )


def test_every_log_has_its_own_row_where_there_are_several(rows):
    assert {r.log for r in rows} == {ALL, "a", "b"}
    assert row(rows, OVERALL, "teacher_forced", log="b").unit == "x floor"
    alone = shrinkage(Damper(), [recorded(TRUTH, "a")], {}, TRUTH, FLOORS)
    assert {r.log for r in alone} == {ALL}


def test_half_an_effect_closes_three_quarters_of_the_square():
    one = row(
        shrinkage(Damper(), [recorded(TRUTH)], {}, {"muscle.coulomb_n": 0.5}, FLOORS),
        "force_n",
        "teacher_forced",
    )
    assert one.closed_share == pytest.approx(0.75, abs=0.02) and one.times_floor == pytest.approx(
        5.1, abs=0.2
    )


def test_a_rig_without_a_gap_has_no_share():
    one = row(
        shrinkage(Damper(), [recorded({})], {}, {"muscle.coulomb_n": 0.001}, FLOORS),
        "force_n",
        "teacher_forced",
    )
    assert (
        one.closed_share is None
        and one.interval is None
        and one.times_floor == pytest.approx(1.0, abs=0.05)
    )


def test_a_rig_without_a_model_of_the_whole_has_no_free_run():
    rig = Damper()
    rig.free_run = lambda recording, values, seed: None
    assert {r.mode for r in shrinkage(rig, [recorded(TRUTH)], {}, TRUTH, FLOORS)} == {
        "teacher_forced"
    }


def test_what_an_operator_asks_for_stands_in_free_run_only():
    rig = Damper()
    whole = rig.free_run

    def with_current(recording, values, seed):
        run = whole(recording, values, seed)
        return replace(
            run, columns=dict(run.columns, motor_current_a=run.columns["force_n"] / 10.0)
        )

    rig.free_run = with_current
    rows = shrinkage(rig, [recorded(TRUTH)], {}, TRUTH, FLOORS)
    energy = row(rows, "energy (integral of motor_current_a squared)", "free_run")
    assert energy.unit == "A^2*s" and energy.before > 10.0 * energy.after
    assert not [r for r in rows if r.mode == "teacher_forced" and "energy" in r.channel]


def test_best_pressure_is_that_of_least_energy_and_needs_three_apart():
    assert best_pressure(np.array([3.0, 1.0, 2.0]), np.array([1e5, 2e5, 3e5])) == 2e5
    assert best_pressure(np.array([3.0, 1.0]), np.array([1e5, 2e5])) is None
    assert best_pressure(np.array([3.0, 1.0, 2.0]), np.array([1e5, 1.01e5, 1.02e5])) is None


def test_a_run_that_ended_early_is_compared_as_far_as_it_went():
    real = recorded(TRUTH)
    short = replace(real, spans=(replace(real.spans[0], stop=5000),))
    ((a, b),) = paired(real, short)
    assert (a.stop - a.start) == (b.stop - b.start) == 4900
    assert "force_n" in channels(real, short) and "ref_travel_m" not in channels(real, short)


def test_where_twins_do_not_differ_the_channels_own_step_is_the_floor():
    step, rig = 0.5, Damper()
    real = recorded(TRUTH)
    coarse = replace(
        real, columns=real.columns | {"force_n": np.round(real.columns["force_n"] / step) * step}
    )
    assert step_of(coarse, "force_n") == pytest.approx(step) and step_of(real, "force_n") == 0.0
    assert row(
        shrinkage(rig, [coarse], {}, TRUTH, FLOORS), "force_n", "free_run"
    ).floor == pytest.approx(NOISE_N, rel=0.05)
    whole = rig.free_run
    rig.free_run = lambda recording, values, seed: whole(recording, values, None)
    assert row(
        shrinkage(rig, [coarse], {}, TRUTH, FLOORS), "force_n", "free_run"
    ).floor == pytest.approx(step / np.sqrt(12.0), rel=0.01)
