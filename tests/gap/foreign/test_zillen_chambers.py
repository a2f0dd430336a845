"""Sealed printed chambers: Ultimaker_015 and Ultimaker_020 leak to nothing, Aluminium holds."""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.rig.foreign import open_foreign
from tests.gap.foreign.real import RIGS, families, recording


@pytest.fixture(scope="module")
def subject():
    return open_foreign(RIGS / "sealed_chamber.yaml")


def chamber(folder, name):
    return recording(folder, "zillen_chamber", f"zillen_pneumatic/chambers/{name}.csv")


@pytest.mark.parametrize(("name", "time_s"), [("Ultimaker_015", 25.0), ("Ultimaker_020", 8.0)])
def test_a_leak_is_named_for_the_chamber_that_leaks(folder, subject, name, time_s):
    found = diagnose(subject, [chamber(folder, name)], how_far=False)
    assert families(found)[0] == "leak"
    assert 0.5 / time_s < found.effects[0].parameters[0].value < 2.0 / time_s
    rivals = [
        next(e for e in subject.catalogue if e.name == rival)
        for rival in found.effects[0].not_separable_from
    ]
    assert {rival.family for rival in rivals} <= {"leak"}


def test_aluminium_has_no_gap(folder, subject):
    found = diagnose(subject, [chamber(folder, "Aluminium")], how_far=False)
    assert found.verdict == "no_gap" and not found.effects
    assert found.location[0].times_floor < 1.2


@pytest.mark.parametrize(("name", "shut_s"), [("Ultimaker_015", 7.0), ("Ultimaker_020", 4.9)])
def test_the_hold_begins_when_the_valve_shuts(folder, subject, name, shut_s):
    hold = subject.prepare(chamber(folder, name)).work.holds[0]
    assert hold.start / 10.0 == pytest.approx(shut_s + 0.5, abs=1.0)


@pytest.mark.parametrize("name", ["Ultimaker_015", "Ultimaker_020"])
def test_free_run_falls_as_the_chamber_does(folder, subject, name):
    real = chamber(folder, name)
    found = diagnose(subject, [real], how_far=False)
    run = subject.free_run(real, found.fitted, None).columns["chamber_pressure_pa"]
    nominal = subject.free_run(real, {}, None).columns["chamber_pressure_pa"]
    apart = [
        float(np.sqrt(np.nanmean((one - real.columns["chamber_pressure_pa"]) ** 2)))
        for one in (nominal, run)
    ]
    assert apart[1] < 0.1 * apart[0]
