"""What the fitted logs hide must serve the logs set aside too."""

import pytest

from epa_rt.gap.diagnosis import Number, Shrinkage
from epa_rt.gap.generic import GenericFit
from epa_rt.gap.held_out import (
    not_carried_over,
    not_closed,
    said_of_held_out,
    said_of_not_closed,
    times_floor,
)
from epa_rt.gap.subject import Link
from epa_rt.gap.yardstick import Left


def row(
    channel="motor_torque_nm",
    before=1.0,
    mode="teacher_forced",
    log="all",
    baseline="refitted",
    after=1.0,
    closed=None,
):
    return Shrinkage(
        channel,
        "N*m",
        mode,
        log,
        2e-3 * before,
        2e-3 * after,
        2e-3,
        closed,
        None,
        1.0,
        "twin",
        baseline,
    )


def test_nothing_stands_apart_near_the_floor_or_without_logs_set_aside():
    assert not_carried_over(()) is None
    assert not_carried_over([row(before=1.9), row("force_n", 1.2)]) is None


def test_noise_that_the_fitted_logs_have_as_well_is_no_gap():
    """A pressure that wanders, on a rig whose file says nothing of that: 2.5 times the floor
    everywhere.
    """
    assert not_carried_over([row(before=2.5)], {"motor_torque_nm": 2.4}) is None
    assert not_carried_over([row(before=2.5)], {"motor_torque_nm": 0.8}) is not None
    assert (
        not_carried_over(
            [row(before=2.5), row("force_n", 5.0)], {"motor_torque_nm": 2.4, "force_n": 1.1}
        ).channel
        == "force_n"
    )


def test_noise_of_the_fitted_logs_is_known_for_every_link_where_two_end_in_one_channel():
    """A drive's current is foretold from its commands and from the motor's motion."""
    links = tuple(
        Link(name, "drive", "motor_current_a", "A", "") for name in ("drive", "motor")
    ) + (Link("muscle0", "muscle", "force_n", "N", ""),)
    left = Left(
        {
            link.name: GenericFit(link.name, 1000, times**2, 1.0, 0.0, ())
            for link, times in zip(links, (2.4, 1.1, 1.0), strict=True)
        }
    )
    known = times_floor(links, left)
    assert known == pytest.approx(
        {"motor_current_a (drive)": 2.4, "motor_current_a (motor)": 1.1, "force_n": 1.0}
    )
    assert not_carried_over([row("motor_current_a (drive)", 2.5)], known) is None
    assert not_carried_over([row("motor_current_a (motor)", 2.5)], known) is not None


def test_the_worst_channel_is_said_with_its_figure():
    found = not_carried_over([row("force_n", 2.5), row(before=8.9), row("speed", 1.0)])
    assert found.channel == "motor_torque_nm"
    assert "motor_torque_nm is 8.9 x" in said_of_held_out(found)


def test_what_the_refit_hides_is_said_with_the_numbers_that_went_furthest():
    """A chamber of which the walls creep: a newcomer reads what was refitted, and that the fitted
    logs are not without a gap.
    """
    leak = Number("chamber.stand_leak_per_s", 4.7467e-5, "1/s", 4.6e-5, 4.9e-5, 2.1e-5)
    says = said_of_held_out(
        row("p_pa", before=2.57), (leak, Number("clock.row_ratio", 1.5, "1", 1.4, 1.5, 0.0))
    )
    assert (
        "what is left in the fitted logs is little from one sample to the next, or nothing that was"
        " measured foresees it; but on the logs set aside p_pa is 2.6 x its noise floor" in says
    )
    assert says.endswith(
        "Furthest from the plant file went chamber.stand_leak_per_s to 4.75e-05 1/s (plant file:"
        " 2.1e-05) and clock.row_ratio to 1.5 (plant file: 0)."
    )
    assert "Furthest" not in said_of_held_out(row("p_pa", before=2.57))


def test_only_block_by_block_against_the_refit_over_all_logs_counts():
    others = [
        row(before=9.0, mode="free_run"),
        row(before=9.0, log="one.mcap"),
        row(before=9.0, baseline="plant_file"),
        row("all channels", 9.0),
    ]
    assert not_carried_over(others) is None


def test_named_effects_that_close_little_of_a_held_out_channel_have_not_explained_it():
    rows = [row("force_n", 9.0, after=1.1, closed=0.99), row(before=8.0, after=7.9, closed=0.02)]
    assert not_closed(rows).channel == "motor_torque_nm"
    assert "motor_torque_nm keeps 7.9 x its noise floor of 8.0 x" in said_of_not_closed(
        not_closed(rows)
    )


def test_what_is_closed_for_the_most_part_or_is_near_the_floor_counts_as_explained():
    assert (
        not_closed(
            [
                row("force_n", 20.0, after=8.0, closed=0.84),
                row(before=1.9, after=1.9, closed=0.0),
                row(before=9.0, mode="free_run", after=9.0),
            ]
        )
        is None
    )


def test_what_makes_a_channel_worse_is_said_so():
    assert (
        "it makes motor_torque_nm worse, 3.0 x its noise floor where it was 1.5 x"
        in said_of_not_closed(not_closed([row(before=1.5, after=3.0, closed=-6.4)]))
    )
