"""What is set aside is what is not fitted, sample for sample."""

import numpy as np
import pytest

from epa_rt.gap.held_out.aside import split
from epa_rt.gap.recording import Recording, Span
from tests.gap.foreign.made import subject_of


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
