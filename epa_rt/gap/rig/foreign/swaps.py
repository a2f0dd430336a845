"""Two channels that an import may have exchanged, on rigs of others: the rig's own plant makes far
more of them the other way round, and no effect that it lacks makes as much of them as they stand.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from epa_rt.gap.finding import Finding
from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.subject import ForeignSubject
from epa_rt.models.effect import Effect

# of what the plant leaves as they stand, with an effect or without, and of all that the output
# varies by, is what it leaves of two that were exchanged (0.01 and 0.02)
SWAPPED = 0.2
SCALES = (
    1.0,
    1e3,
    1e-3,
    # with which an exchanged column has been read where the two have different units: millimetres
    # beside newtons
)
# of the rows that are judged as they stand are judged at least then: something that hardly moves is
# at rest, and nothing is left of it
JUDGED = 0.5
ROUNDS = 3  # of the refits
ROUNDING = 1e-9  # of a column's largest value


def check_swaps(recordings: Sequence[Recording], subject: ForeignSubject) -> list[Finding]:
    """Refusals of logs in which two measured or commanded channels are what the plant expects once
    they are exchanged, and as they stand are not.
    """
    return [finding for recording in recordings for finding in _checked(recording, subject)]


def _checked(recording: Recording, subject: ForeignSubject) -> list[Finding]:
    unit_of = {
        subject.rig.channels[channel.role]: channel.unit
        for channel in subject.rig.component.channels
        if channel.required
    }
    names = [
        name for name in unit_of if name in recording.columns and _varies(recording.columns[name])
    ]
    as_is, rows = _left(recording, subject) if len(names) > 1 else (0.0, 0)
    suspect = []
    for one, other in combinations(names, 2):
        for scale in SCALES[: 1 if unit_of[one] == unit_of[other] else None]:
            turned, judged = _left(_exchanged(recording, one, other, scale), subject)
            if turned < SWAPPED * min(as_is, 1.0) and judged > JUDGED * rows:
                suspect.append((one, other, turned))
    if not suspect:
        return []
    least = SWAPPED * _left_with_an_effect(recording, subject)
    return [
        Finding(
            "refuse",
            "swapped",
            recording.name,
            one,
            f"{recording.name}: {one}: found the plant to leave {_percent(as_is)} of its output's"
            f" variance with it and {other} as they stand and {_percent(turned)} with the two"
            " exchanged, expected it the other way round: the import's mapping may have exchanged"
            " them",
        )
        for one, other, turned in suspect
        if turned < least
    ][:1]


def _varies(values: np.ndarray) -> bool:
    """Whether a column changes by more than rounding: a constant is nobody's output."""
    finite = values[np.isfinite(values)]
    return bool(finite.size) and float(np.ptp(finite)) > ROUNDING * float(np.abs(finite).max())


def _exchanged(recording: Recording, one: str, other: str, scale: float) -> Recording:
    return replace(
        recording,
        columns={
            **recording.columns,
            one: recording.columns[other] * scale,
            other: recording.columns[one] / scale,
        },
    )


def _percent(part: float) -> str:
    return f"{100.0 * part:.3g} %"


def _left_with_an_effect(recording: Recording, subject: ForeignSubject) -> float:
    """Part of the outputs' variance that the plant leaves with the effect that leaves least."""
    return min((_left(recording, subject, one)[0] for one in subject.catalogue), default=np.inf)


def _left(
    recording: Recording, subject: ForeignSubject, effect: Effect | None = None
) -> tuple[float, int]:
    """Part of the outputs' variance that the plant leaves, its nominal parameters fitted and those
    of an effect, the largest of all links; and rows that were judged.
    """
    outputs = {link.name: recording.columns[link.channel] for link in subject.links}
    sizes = {name: float(np.nanstd(out)) for name, out in outputs.items() if _varies(out)}
    with np.errstate(all="ignore"):
        problem = Problem(
            subject.evenly(),
            [recording],
            {
                link: Floor(link, size, np.zeros(0), size)
                for link, size in sizes.items()
                if size > 0.0
            },
        )
        effects = (effect.name,) if effect else ()
        begun = dict(zip(effect.knobs, effect.starts[0], strict=True)) if effect else {}
        fit = settled(problem, effects, begun, rounds=ROUNDS)
        residual = [left for left in fit.residual.values() if len(left)]
    parts = [
        float(np.var(left)) for left in residual
    ]  # a mean is an offset's, whatever else is wrong
    return max((part if np.isfinite(part) else np.inf for part in parts), default=0.0), sum(
        map(len, residual)
    )
