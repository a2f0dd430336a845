"""Trials that were pasted into one file are as many runs."""

from dataclasses import replace

import numpy as np

from epa_rt.gap.recording import Span
from epa_rt.gap.rig.foreign.pasted import FEWEST_ROWS, as_runs
from tests.gap.foreign.made import subject_of, with_output

CUT = 2 * FEWEST_ROWS


def in_two(jump_rad: float, gap: int = 0):
    """A servo's recording as two trials; the second begins ``jump_rad`` away."""
    made, subject = with_output("servo", {}), subject_of("servo")
    name = subject.rig.channels["position"]
    values = made.columns[name].copy()
    values[CUT:] += jump_rad - (values[CUT] - values[CUT - 1])
    spans = (Span("trial[0]", 0, CUT - gap, True), Span("trial[1]", CUT, made.samples, True))
    return replace(made, columns={**made.columns, name: values}, spans=spans), subject


def test_a_place_that_jumps_between_trials_makes_them_runs():
    log, subject = in_two(3.0)
    first, second = as_runs([log], subject)
    assert (first.samples, second.samples) == (CUT, log.samples - CUT)
    assert first.name == "made trial[0]" and second.spans == (
        Span("trial[1]", 0, second.samples, True),
    )
    name = subject.rig.channels["position"]
    assert np.array_equal(second.columns[name], log.columns[name][CUT:])
    assert np.array_equal(second.cycle, log.cycle[CUT:])


def test_trials_that_follow_each_other_in_motion_or_with_rows_between_stay_one_log():
    for log, subject in (in_two(0.0), in_two(3.0, gap=5)):
        assert as_runs([log], subject) == (log,)


def test_trials_too_short_to_stand_alone_stay_together():
    log, subject = in_two(3.0)
    short = replace(log, spans=(Span("trial[0]", CUT - 9, CUT, True), log.spans[1]))
    assert as_runs([short], subject) == (short,)
