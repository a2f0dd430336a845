"""What is set aside is what is not fitted, sample for sample."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from epa_rt.gap.held_out.aside import split
from epa_rt.gap.recording import Recording, Span
from tests.gap.foreign.made import one_trial, subject_of


@pytest.mark.parametrize("rate_hz", [49.6, 50.0, 50.4, 99.2])
def test_the_last_trial_of_a_log_whose_rate_is_a_little_off_is_set_aside_as_it_stands(rate_hz):
    """Over ten minutes 0.8 % are five seconds."""
    subject = subject_of("servo")
    trials = np.linspace(0, round(600.0 * rate_hz), 11).astype(int)
    command = np.sin(np.arange(trials[-1]) / rate_hz)
    columns = {
        subject.rig.channels["command"]: command,
        subject.rig.channels["position"]: command + 0.01 * np.sin(np.arange(len(command))),
    }
    recording = Recording(
        "log",
        "",
        subject.name,
        "",
        "",
        1.0 / rate_hz,
        np.arange(len(command)),
        columns,
        tuple(
            Span(f"trial {i}", int(a), int(b), True)
            for i, (a, b) in enumerate(zip(trials[:-1], trials[1:], strict=True))
        ),
    )
    fitted, judged = (
        np.isfinite(part.residual(part.prepare(recording), {}, subject.links[0].name))
        for part in split(subject, [recording])
    )
    first, stride = trials[-2], round(rate_hz / subject.rate_hz)
    assert not np.any(fitted & judged)
    assert (
        abs(np.flatnonzero(fitted)[-1] * stride - first) <= stride
        and abs(np.flatnonzero(judged)[0] * stride - first) <= stride
    )
    assert fitted.sum() == pytest.approx(0.9 * len(fitted), rel=0.01)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_of_logs_with_one_trial_each_that_with_most_of_the_gap_is_fitted(order):
    """One that nothing else excites would be held against fits that know nothing of it."""
    subject = subject_of("servo")
    gaps = (0.0, 1e-3, 0.1)
    logs = [_one_trial(subject, f"log {i}", gaps[i]) for i in order]
    judged = split(subject, logs)[1].only(logs)
    assert [one.name for one in judged] == ["log 1"]  # and not the one that shows nothing of it


def _one_trial(subject, name: str, gap_rad: float) -> Recording:
    command = 0.3 * np.sin(np.arange(1000) / subject.rate_hz)
    command_of, position_of = (subject.rig.channels[role] for role in ("command", "position"))
    columns = {command_of: command, position_of: command}
    log = one_trial(name, subject.name, 1.0 / subject.rate_hz, columns)
    made = subject.free_run(log, {}, None)
    bent = made.columns[position_of] + gap_rad * np.sin(np.arange(1000) / 7.0)
    return replace(made, columns={**made.columns, position_of: bent})


def test_a_log_in_which_the_plant_runs_away_is_fitted():
    subject = subject_of("servo")
    logs = [
        _one_trial(subject, f"log {i}", gap_rad) for i, gap_rad in enumerate((1e-3, 1e200, 0.0))
    ]
    (judged,) = split(subject, logs)[1].only(logs)
    assert judged.name != "log 1"
