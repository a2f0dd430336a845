"""--baseline is refused in a sentence where it can mean nothing."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.baseline import FAR, _learnt, _stamped, as_a_set, change_words, said_of
from epa_rt.cli.gap.diagnose import diagnose_logs
from epa_rt.gap.diagnosis import Change, Diagnosis, Named
from tests.cli.shell import RIGS, ROOT

FRICTION = Change("friction.coulomb_n", "N", 24.8, 0.65, 30.9, 9.4)
WHOLE = Change("force as a whole", "N", 0.0, 1.4, 2.1, 1.5)


def test_a_rig_of_this_house_is_refused_before_any_log_is_read():
    with pytest.raises(VerbError, match="a rig of this house, expected a rig of others"):
        diagnose_logs(RIGS / "bench.yaml", None, [Path("no.mcap")], baseline=[Path("none.mcap")])


def test_a_log_that_is_not_there_is_one_sentence():
    rig = ROOT / "config/rigs_foreign/emps.yaml"
    with pytest.raises(VerbError, match=r"no\.mcap"):
        diagnose_logs(rig, None, [Path("no.mcap")], baseline=[Path("none.mcap")])


def test_a_plant_file_that_has_changed_is_read_again(tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(
        "epa_rt.cli.gap.baseline.opened",
        lambda given: read.append(given) or SimpleNamespace(subject=None, recordings=(), found=()),
    )
    monkeypatch.setattr("epa_rt.gap.rig.foreign.healthy.healthy_from", lambda *_: None)
    rig, plant = tmp_path / "rig.yaml", tmp_path / "plant.yaml"
    for text in ("mass: 95 kg", "mass: 95 kg", "mass: 60.5 kg"):
        if not plant.exists() or plant.read_text() != text:
            plant.write_text(text)
        rig.touch(exist_ok=True)
        _learnt(rig, plant, (_stamped(plant),), ())
    assert len(read) == 2


def test_what_moved_is_said_with_its_size_in_spreads():
    moved = said_of([FRICTION, WHOLE], 20, True)
    assert moved.startswith("Since the baseline of 20 runs moved: friction.coulomb_n from 24.8 to")
    assert moved.endswith("30.9 N (+9.4 spreads).")
    still = said_of([WHOLE], 20, False)
    assert f"nothing moved by {FAR:g} spreads" in still and change_words(WHOLE) in still
    assert "2.1 N rms (+1.5 spreads)" in still
    assert "nothing moved" not in said_of([WHOLE], 20, True)


def test_what_the_motion_cannot_tell_apart_is_a_set():
    named = Named("viscous_changed", "viscous", "friction", (), 0.98, 900.0)
    found = as_a_set(Diagnosis("explained", "It is it.", effects=(named,)), ("coulomb", named.name))
    assert found.verdict == "not_separable" and "cannot tell coulomb from" in found.says
    assert found.effects[0].not_separable_from == ("coulomb",)
    other = Diagnosis("explained", "It is it.", effects=(named,))
    assert as_a_set(other, ("coulomb", "offset")) is other
