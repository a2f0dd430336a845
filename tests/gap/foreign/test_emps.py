"""DATA_EMPS and DATA_EMPS_PULSES: a motor with ball screw and carriage, from a plant with inertia
and viscous friction only.

The benchmark's own values (Simulation_EMPS.m): inertia 95.11 kg, viscous 203.50 N s/m, Coulomb
20.39 N, offset -3.16 N.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.rig.foreign import open_foreign
from epa_rt.gap.rig.foreign.baseline import cut
from tests.gap.foreign.real import RIGS, recording

pytestmark = pytest.mark.xdist_group("emps")  # its fixtures cost more than its tests
LAP = 6240


@pytest.fixture(scope="module")
def emps(folder):
    return recording(folder, "emps", "emps/DATA_EMPS.mat")


@pytest.fixture(scope="module")
def pulses(folder):
    return recording(folder, "emps_pulses", "emps/DATA_EMPS_PULSES.mat")


@pytest.fixture(scope="module")
def subject():
    return open_foreign(RIGS / "emps.yaml")


@pytest.fixture(scope="module")
def found(subject, emps, pulses):
    return diagnose(subject, [emps], [pulses])


def test_coulomb_friction_and_an_offset_are_named(found):
    assert found.effects[0].name == "coulomb" and found.effects[0].confidence > 0.8
    assert found.effects[1].family == "offset" and "4.4 times the floor" in found.says
    assert set(found.posterior.models[0].effects) == {"coulomb", "offset_with_speed"}


def test_coulomb_and_viscous_friction_are_the_benchmarks(found):
    assert found.fitted["friction.coulomb_n"] == pytest.approx(20.3935, rel=0.05)
    assert found.fitted["friction.viscous_n_s_m"] == pytest.approx(203.5034, rel=0.05)
    assert found.fitted["carriage.inertia_kg"] == pytest.approx(95.1089, rel=0.05)


@pytest.mark.slow  # a diagnosis of its own, of which the first test asks most
def test_the_constant_offset_is_the_next_where_no_offset_grows_with_speed(subject, emps):
    plain = diagnose(subject, [emps], without=("offset_with_speed", "offset_moving"), how_far=False)
    assert plain.effects[0].name == "coulomb"
    assert "Perhaps also offset (offset 0.2" in plain.says


def test_force_on_the_held_out_trajectory(found):
    row = next(
        row
        for row in found.shrinkage
        if row.channel == "motor_force_n" and row.baseline == "plant_file"
    )
    assert row.after <= 4.3 and row.before > 8.0  # as rows count
    assert row.floor == pytest.approx(0.26, abs=0.05)  # as laps repeat, not as pulses scatter


def test_what_is_left_is_far_above_the_laps_and_described(found):
    rest = found.remainder[0]
    assert rest.rms > 4.0 * rest.floor and rest.floor < 0.3 and rest.depends_on
    assert found.verdict == "explained"


def test_laps_are_found_and_repeat(subject, emps, pulses):
    apart = subject.repeats(emps)["force"]
    assert np.sqrt(np.nanmean(apart**2)) == pytest.approx(0.26, abs=0.03)
    from epa_rt.gap.rig.foreign.repeats import lap_samples

    assert lap_samples(subject.prepare(emps).signals.columns, 1e3) == LAP
    assert (
        lap_samples(subject.prepare(pulses).signals.columns, 1e3) is None
    )  # pulses do not keep step with laps


@pytest.mark.parametrize(
    "lap", [0, 3, *(pytest.param(lap, marks=pytest.mark.slow) for lap in (1, 2))]
)
def test_a_lap_against_the_others_has_no_gap(subject, emps, lap):
    laps = [cut(emps, LAP * i, LAP * (i + 1), f"lap_{i + 1}") for i in range(4)]
    rest = [one for i, one in enumerate(laps) if i != lap]
    assert diagnose(subject.against(*rest), [laps[lap]], how_far=False).verdict == "no_gap"
