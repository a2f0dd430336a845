"""A log whose rows are counted otherwise than this house's loop counts them is refused with the
line that mends it; a sound one and a late drive are not.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.rig.house.early import check_early
from epa_rt.gap.rig.subjects import open_subject
from tests.cli.shell import RIGS
from tests.gap.recorded import recording_of


def later(recording, rows):
    """The commands so many rows later than the loop had them, as a recorder of another convention
    writes them.
    """
    at = np.clip(np.arange(recording.samples) - rows, 0, recording.samples - 1)
    return replace(
        recording,
        columns={
            name: values[at] if name.startswith("cmd_") else values
            for name, values in recording.columns.items()
        },
    )


@pytest.mark.parametrize("rig", ["bench", "knee"])
@pytest.mark.parametrize(("rows", "after"), [(1, 1), (2, 0)])
def test_rows_of_another_convention_are_refused_with_the_line_that_mends_them(rig, rows, after):
    found = check_early(
        [later(recording_of(rig, "step"), rows)], open_subject(RIGS / f"{rig}.yaml")
    )
    assert (
        len(found) == 1
        and found[0].severity == "refuse"
        and f"answers {rows} row" in found[0].says
        and f"'answered_after: {after}' in the mapping" in found[0].says
    )


@pytest.mark.parametrize(("rig", "rows"), [("bench", 0), ("bench", -1), ("bench", -3), ("knee", 0)])
def test_a_sound_log_and_a_drive_that_answers_late_pass(rig, rows):
    assert (
        check_early([later(recording_of(rig, "step"), rows)], open_subject(RIGS / f"{rig}.yaml"))
        == ()
    )
