"""Half a count of the motor's angle: nothing for a spool, tenths of an ampere for a stiff drive.
How a rig counts is read from its own loop.
"""

import pytest

from epa_rt.gap.rig.house.channels import channels_of
from epa_rt.gap.rig.house.counter import PORT, as_counted
from epa_rt.gap.rig.subjects import open_subject
from tests.cli.shell import RIGS
from tests.gap.recorded import recording_of, rig_of_name, scaled


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_counts_that_are_rounded_are_read_so_and_that_is_said(rig):
    log = recording_of(rig, "step")  # in position mode: a speed loop does not mind
    subject, channel = open_subject(RIGS / f"{rig}.yaml"), channels_of(rig_of_name(rig))[PORT]
    same, nothing = as_counted(subject, [log])
    assert same is subject and not nothing and subject.channels[PORT].floors
    nearest = scaled(channel.column, 1.0, 0.5 * channel.step / channel.scale)(
        log
    )  # the mean of what rounds lies half a count higher than of what is cut
    other, (finding,) = as_counted(subject, [nearest])
    assert not other.channels[PORT].floors and subject.channels[PORT].floors
    assert (
        finding.severity == "note"
        and finding.channel == channel.column
        and "rounded" in finding.says
    )


def test_a_rig_without_a_drive_of_its_own_loop_is_read_as_ever():
    subject = open_subject(RIGS / "mass.yaml")
    without = subject.on_channels(
        {port: one for port, one in subject.channels.items() if port != PORT}
    )
    assert as_counted(without, [recording_of("mass", "mass_sine")]) == (without, ())
