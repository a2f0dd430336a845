"""On the emulated bus a drive that lost its supply is refused, and homed back to a run."""

import pytest

from tests.bus.own_network import call


@pytest.mark.network
@pytest.mark.parametrize("rig", [pytest.param("bench", marks=pytest.mark.slow), "bench_analog"])
def test_a_drive_that_lost_its_supply_is_refused_and_homed(rig):
    said = call("tests.bus.driver.homed:lost_and_homed", rig=rig)
    wired = rig == "bench_analog"
    # a wired drive keeps no zero and is not run before a file says where it is
    assert said["without"][0] == (3 if wired else 0), said["without"]
    assert not wired or "found no file that says where travel is zero" in said["without"][1]
    assert said["first"][0] == 0, said["first"]
    for refused in ("refused", "still"):
        code, words = said[refused]
        assert code == 3 and "epa home" in words, words
        assert ("status word bit 15" in words) is not wired
    assert "tripped: unreferenced: " in said["refused"][1]
    assert said["jog"][0] == 0, said["jog"]
    assert said["home"][0] == 0 and "scatter" in said["home"][1], said["home"]
    assert said["again"][0] == 0, said["again"]
    assert abs(said["travel_m"] - 0.012) < 0.0003  # the plant's own travel, where 12 mm were asked
    assert said["of_the_rig"] is False  # nothing tried here says anything of the rig
    assert "method: taut_strap" in said["zero"] and ("offset:" in said["zero"]) is wired
