"""Rows that are lost one by one do not make a log undiagnosable; holes that a line cannot bridge
are judged nowhere.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.gap.foreign.made import subject_of, with_output


def without_rows(recording, lost: np.ndarray):
    kept = ~lost
    return replace(
        recording,
        cycle=recording.cycle[kept],
        columns={name: values[kept] for name, values in recording.columns.items()},
        spans=tuple(replace(span, stop=int(kept.sum())) for span in recording.spans),
    )


@pytest.mark.parametrize(("rows", "judged"), [(1, True), (40, False)])
def test_single_lost_rows_are_bridged_and_long_holes_are_not(rows, judged):
    subject, whole = subject_of("carriage"), with_output("carriage", {})
    lost = np.zeros(whole.samples, bool)
    for first in range(200, whole.samples - 200, 200):
        lost[first : first + rows] = True
    clean, holed = (subject.prepare(one) for one in (whole, without_rows(whole, lost)))
    share = (
        np.isfinite(subject.residual(holed, {}, "force")).mean()
        / np.isfinite(subject.residual(clean, {}, "force")).mean()
    )
    assert bool(share > 0.9) is judged
    if judged:
        assert np.nanstd(subject.residual(holed, {}, "force")) < 0.05 * np.nanstd(
            holed.signals.columns["force"]
        )
