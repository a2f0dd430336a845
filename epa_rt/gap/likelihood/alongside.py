"""Two recordings of the same experiment held against each other: channel by channel over the
trials, and in what counts.

The second one comes from a free run or from a run of the simulated rig; its trials are found by
their order.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import UnitError
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Subject

BLOCK_S = 1.5
_NO_CHANNEL = ("cmd_", "ref_", "est_", "sent_")
_SPREAD_PA = 10e3  # pressures of trials closer together than this have no best one


class Figure(NamedTuple):
    """One number per trial that an operator asks for: tracking error, energy, pressure."""

    name: str
    unit: str
    values: np.ndarray  # (trials,)


def unit_of(subject: Subject, channel: str) -> str:
    """SI unit of a channel: what its name ends in, else that of the link that ends in it; '' where
    neither says.
    """
    try:
        return si_unit_of(channel)
    except UnitError:
        return next((link.unit for link in subject.links if link.channel == channel), "")


def channels(real: Recording, other: Recording) -> tuple[str, ...]:
    """Measured channels that both have and that move."""
    return tuple(
        name
        for name, values in real.columns.items()
        if not name.startswith(_NO_CHANNEL)
        and not name.endswith(("_raw", "_open", "_enable"))
        and name in other.columns
        and np.nanmax(values, initial=-np.inf) > np.nanmin(values, initial=np.inf)
    )


def trials(recording: Recording) -> tuple[Span, ...]:
    """What is to be judged: the trials; the whole recording where it has none."""
    found = tuple(span for span in recording.spans if span.trial)
    return found or (Span("all", 0, recording.samples, True),)


def paired(real: Recording, other: Recording) -> list[tuple[Span, Span]]:
    """Trials of both in their order, cut to the same number of samples."""
    pairs = []
    for a, b in zip(trials(real), trials(other), strict=False):  # a run that ended early has fewer
        n = min(a.stop - a.start, b.stop - b.start)
        pairs.append(
            (Span(a.name, a.start, a.start + n, True), Span(b.name, b.start, b.start + n, True))
        )
    return pairs


def misfit(real: Recording, other: Recording, channel: str, rate_hz: float) -> list[np.ndarray]:
    """Measured minus other per trial, averaged over the samples of one ``1/rate_hz``: a list of
    (n,).
    """
    step = max(round(1.0 / (rate_hz * real.period_s)), 1)
    found = []
    for a, b in paired(real, other):
        difference = (
            real.columns[channel][a.start : a.stop] - other.columns[channel][b.start : b.stop]
        )
        whole = len(difference) // step * step
        found.append(difference[:whole].reshape(-1, step).mean(axis=1))
    return found


def step_of(recording: Recording, channel: str, everywhere: bool = False) -> float:
    """The smallest step in which a channel was recorded over the trials, or ``everywhere``; 0 where
    hardly a value comes twice.
    """
    spans = (Span("all", 0, recording.samples, False),) if everywhere else trials(recording)
    values = np.concatenate([recording.columns[channel][span.start : span.stop] for span in spans])
    values = values[np.isfinite(values)]
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.5 * len(values):
        return 0.0
    steps = np.diff(levels)
    return float(steps[steps > 1e-9 * (levels[-1] - levels[0])].min())


def figures(recording: Recording, references: Recording | None = None) -> tuple[Figure, ...]:
    """What an operator asks of a run, one number per trial. ``references``: where its references
    stand, if not in itself.
    """
    return (
        *_tracking(recording, references or recording),
        *_energy(recording),
        *_pressure(recording),
    )


def best_pressure(energies: np.ndarray, pressures_pa: np.ndarray) -> float | None:
    """The pressure of the trial that took the least energy; None for fewer than three pressures
    apart.
    """
    good = np.isfinite(energies) & np.isfinite(pressures_pa)
    if good.sum() < 3 or np.ptp(pressures_pa[good]) < 3.0 * _SPREAD_PA:
        return None
    return float(pressures_pa[good][np.argmin(energies[good])])


def _tracking(recording: Recording, references: Recording) -> list[Figure]:
    found = []
    for name in recording.columns:
        reference = references.columns.get(f"ref_{name}")
        if reference is None or name.endswith(("_pa", "_m_s", "_rad_s", "_raw")):
            continue
        errors = [
            _rms(recording.columns[name][a.start : a.stop] - reference[b.start : b.stop])
            for a, b in paired(recording, references)
        ]
        if np.isfinite(errors).any():
            found.append(Figure(f"tracking error of {name}", si_unit_of(name), np.array(errors)))
    return found


def _energy(recording: Recording) -> list[Figure]:
    names = [
        name
        for name in recording.columns
        if name.endswith("_current_a") and not name.startswith(_NO_CHANNEL)
    ]
    return [
        Figure(
            f"energy (integral of {name} squared)",
            "A^2*s",
            np.array(
                [
                    np.nansum(recording.columns[name][span.start : span.stop] ** 2)
                    * recording.period_s
                    for span in trials(recording)
                ]
            ),
        )
        for name in names
    ]


def _pressure(recording: Recording) -> list[Figure]:
    names = [
        name
        for name in recording.columns
        if name.endswith("pressure_pa")
        and not name.startswith(_NO_CHANNEL)
        and np.isfinite(recording.columns[name]).any()
    ]
    return [
        Figure(
            f"mean {name} of a trial",
            "Pa",
            np.array(
                [
                    _mean(recording.columns[name][span.start : span.stop])
                    for span in trials(recording)
                ]
            ),
        )
        for name in names
    ]


def figure_misfits(
    real: Recording, others: Sequence[Recording]
) -> list[tuple[str, str, list[np.ndarray]]]:
    """Name, unit and per trial the difference of each figure in ``others`` to the real one: a list
    of (trials,) arrays.
    """
    of_real, of_others = (
        figures(real),
        [{one.name: one for one in figures(other, real)} for other in others],
    )
    found = []
    for one in of_real:
        if all(one.name in theirs for theirs in of_others):
            n = min(len(one.values), *(len(theirs[one.name].values) for theirs in of_others))
            found.append(
                (
                    one.name,
                    one.unit,
                    [theirs[one.name].values[:n] - one.values[:n] for theirs in of_others],
                )
            )
    return found + _best(real, others)


def _best(real: Recording, others: Sequence[Recording]) -> list[tuple[str, str, list[np.ndarray]]]:
    def of(recording: Recording) -> float | None:
        energy, pressure = _energy(recording), _pressure(recording)
        return best_pressure(energy[0].values, pressure[0].values) if energy and pressure else None

    best = [of(recording) for recording in (real, *others)]
    if any(one is None for one in best):
        return []
    return [("best pressure (least energy)", "Pa", [np.array([one - best[0]]) for one in best[1:]])]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else float("nan")


def _mean(values: np.ndarray) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
