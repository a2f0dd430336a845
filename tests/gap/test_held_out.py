"""What the fitted logs hide must serve the logs set aside too."""

from epa_rt.gap.diagnosis import Shrinkage
from epa_rt.gap.held_out import not_carried_over, said_of_held_out


def row(channel="motor_torque_nm", before=1.0, mode="teacher_forced", log="all", baseline="refitted"):
    return Shrinkage(channel, "N*m", mode, log, 2e-3 * before, 2e-3, 2e-3, None, None, 1.0, "twin", baseline)


def test_nothing_stands_apart_near_the_floor_or_without_logs_set_aside():
    assert not_carried_over(()) is None
    assert not_carried_over([row(before=1.9), row("force_n", 1.2)]) is None


def test_the_worst_channel_is_said_with_its_figure():
    found = not_carried_over([row("force_n", 2.5), row(before=8.9), row("speed", 1.0)])
    assert found.channel == "motor_torque_nm"
    assert "motor_torque_nm is 8.9 x" in said_of_held_out(found)


def test_only_block_by_block_against_the_refit_over_all_logs_counts():
    others = [row(before=9.0, mode="free_run"), row(before=9.0, log="one.mcap"), row(before=9.0, baseline="plant_file"), row("all channels", 9.0)]
    assert not_carried_over(others) is None
