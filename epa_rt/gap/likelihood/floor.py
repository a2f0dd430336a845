"""The noise floor of every link: what is left of a rig without a gap, in size and in colour.

By laps where the motion is repeated; else by twins, the nominal plant in free run through
the same links with the recording's own noise and the instruments' own steps; else from the
residuals' own high frequencies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from epa_rt.gap.likelihood.colour import autocovariance, levinson, white_size
from epa_rt.gap.likelihood.significance import scatter
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each
from epa_rt.gap.subject import Subject, Values

ORDER = 16  # of the whitening filter
TWINS = 6  # per recording
APART = 0.3  # of a nominal parameter's spread, between twins
LEAST = 1e-12  # what no floor falls below, in its link's unit: data without noise
# deviations by which what twins have in common must stand out from chance (biases of a drive: 3 to
# 18; of none: at most 2)
SURE = 3.0
FLOOR_SEEDS = (1, 2, 3)  # of twins that tell what noise alone makes of a figure
LOST = 6.0  # spreads from which a gap has driven a nominal parameter beyond belief


@dataclass(frozen=True)
class Floor:
    """Noise of a link: ``rms`` in its unit, ``ar`` (ORDER,) so that x[k] - sum ar[i] x[k-1-i] is
    white with deviation ``innovation``. ``bias``: recording name to (n,), what the method leaves
    even of a perfect model; NaN where not judged. ``source``: "repeats", "twin" or "sensors".
    ``scatter``: deviations of its chi-square that count as one; more than 1 where steps that no
    noise dithers make twins of one plant differ by more than noise does.
    """

    link: str
    rms: float
    ar: np.ndarray
    innovation: float
    bias: dict[str, np.ndarray] = field(default_factory=dict)
    source: str = "twin"
    scatter: float = 1.0

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """(n,) or (n, k) to the same shape: unit white noise where x is the floor's own noise.

        NaN rows part x into spans that are filtered separately; the first len(ar) rows of each are
        NaN.
        """
        x = np.asarray(x, float)
        order = len(self.ar)
        out = np.full(x.shape, np.nan)
        if len(x) <= order:
            return out
        taps = np.concatenate([[1.0], -np.asarray(self.ar, float)]) / self.innovation
        if not np.any(self.ar):  # nothing but a size, to the bit
            torn = np.cumsum(~np.isfinite(x), axis=0)
            gone = torn[order:] - np.concatenate([np.zeros_like(torn[:1]), torn[: -order - 1]])
            out[order:] = np.where(gone > 0, np.nan, x[order:] * taps[0])
            return out
        for white, one in zip(*(np.atleast_2d(a.T) for a in (out, x)), strict=True):
            white[order:] = np.convolve(one, taps, "valid")
        return out


def unbiased(residual: np.ndarray, floor: Floor, recording: str) -> np.ndarray:
    """(n,) a residual without what the method itself leaves of a rig without a gap; of a recording
    that goes further than the floor has seen of it, nothing is known there.
    """
    bias = floor.bias.get(recording)
    if bias is None:
        return residual
    found = residual.copy()
    count = min(len(bias), len(found))
    found[:count] -= bias[:count]
    return found


def weight(subject: Subject, prepared: object, floor: Floor) -> np.ndarray | float:
    """(n,) 0 to 1 by which a link's residual counts, so that a row's own variance counts as noise:
    1 / sqrt(1 + variance / rms^2).
    """
    variance = subject.row_variance(prepared, floor.link)
    return 1.0 if variance is None else floor.rms / np.sqrt(floor.rms**2 + variance)


def left_over(
    subject: Subject,
    prepared: object,
    values: Values,
    floor: Floor,
    recording: str,
    counts: np.ndarray | float | None = None,
) -> np.ndarray:
    """(n,) a link's residual as it counts: without what the method itself leaves, and for less
    where a row has a variance of its own. ``counts``: its ``weight``, where that is known already.
    KeyError for an unknown number or link.
    """
    found = unbiased(subject.residual(prepared, values, floor.link), floor, recording)
    return found * (weight(subject, prepared, floor) if counts is None else counts)


def floors(
    subject: Subject, recordings: Sequence[Recording], values: Values, seed: int = 0
) -> dict[str, Floor]:
    """Link name to its floor at these nominal values; links that the recordings never let judge are
    left out.

    Raises KeyError where a recording lacks a column, or a number of ``values`` is unknown.
    """
    made = each(
        lambda r: (_residuals(subject, r, values), _twins(subject, r, values, seed)), recordings
    )
    own, twins = (
        {r.name: of_recording[i] for r, of_recording in zip(recordings, made, strict=True)}
        for i in range(2)
    )
    found = {}
    for link in subject.links:
        if not any(np.isfinite(own[r.name][link.name]).any() for r in recordings):
            continue
        own_twins = {name: [twin[link.name] for twin in made] for name, made in twins.items()}
        noise = _about_mean(own_twins)
        again = _of_laps(subject, recordings, values, link.name)
        source = "repeats" if again else ("twin" if noise else "sensors")
        floor = (
            fitted(link.name, again or noise, source)
            if again or noise
            else white(link.name, _roughness(subject, recordings, own, values, link.name), source)
        )
        floor = _with_bias(floor, own_twins)
        found[link.name] = replace(floor, scatter=scatter(floor.whiten, floor.bias, own_twins))
    return found


def _residuals(subject: Subject, recording: Recording, values: Values) -> dict[str, np.ndarray]:
    prepared = subject.prepare(recording)
    return {link.name: subject.residual(prepared, values, link.name) for link in subject.links}


def _twins(
    subject: Subject, recording: Recording, values: Values, seed: int
) -> list[dict[str, np.ndarray]]:
    """Residuals of TWINS free runs of a recording, judged where the recording is; none where there
    is no model of the whole.

    Each but the first is another plant near ``values`` and is judged as that plant: rounding that
    hangs on the commands is then the same in all and counts as bias, rounding that hangs on chance
    does not.
    """
    random = np.random.default_rng(seed)
    first = int(
        random.integers(1, 2**31)
    )  # seeds in a row: a subject may spread evenly over them what few twins would sample badly
    found = []
    for i in range(TWINS):
        own = dict(values)
        for knob in subject.nominal:
            at = (
                own.get(knob.key, knob.value)
                + (APART if i else 0.0) * knob.spread * random.standard_normal()
            )
            own[knob.key] = float(np.clip(at, knob.low, knob.high))
        twin = subject.free_run(recording, own, first + i)
        if twin is None:
            return []
        found.append(_residuals(subject, twin, own))
    return found


def _about_mean(twins: Mapping[str, Sequence[np.ndarray]]) -> list[np.ndarray]:
    """The noise of every recording's twins about their mean, with its full size."""
    several = [made for made in twins.values() if len(made) > 1]
    return [
        (twin - mean) * np.sqrt(len(made) / (len(made) - 1.0))
        for made in several
        for mean in [np.mean(made, axis=0)]
        for twin in made
    ]


def _with_bias(floor: Floor, twins: Mapping[str, Sequence[np.ndarray]]) -> Floor:
    """The floor with what the twins of a recording have in common, where they agree on it, and the
    chance of few twins in its size.
    """
    sure = {
        name: np.mean(made, axis=0)
        for name, made in twins.items()
        if len(made) > 2 and _agree([floor.whiten(twin) for twin in made])
    }
    blur = float(np.sqrt(1.0 + len(sure) / max(len(twins), 1) / TWINS))
    return replace(floor, rms=floor.rms * blur, innovation=floor.innovation * blur, bias=sure)


def _agree(white: Sequence[np.ndarray]) -> bool:
    """Whether every two twins have something in common: the mean of their products against how much
    it hangs on any one of them (jackknife).

    No count of samples says that: where a reading lies on its converter's step may stay for
    seconds, another one in every twin, and few twins' mean of it is far from 0 though the rig's is
    another again.
    """
    judged = np.isfinite(white).all(axis=0)
    values = np.array(white)[:, judged]
    products = values @ values.T / max(int(judged.sum()), 1)
    np.fill_diagonal(products, 0.0)
    count, own = len(values), products.sum(axis=1)
    without = (products.sum() - 2.0 * own) / ((count - 1) * (count - 2))
    chance = np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2))
    return bool(products.sum() / (count * (count - 1)) > SURE * chance)


def _of_laps(
    subject: Subject, recordings: Sequence[Recording], values: Values, link: str
) -> list[np.ndarray]:
    """What the laps of a recording differ by, where its subject can say so."""
    found = [subject.repeats(recording, values) for recording in recordings]
    return [one[link] for one in found if one and np.isfinite(one[link]).sum() > 4 * ORDER]


def _roughness(
    subject: Subject,
    recordings: Sequence[Recording],
    own: Mapping[str, Mapping[str, np.ndarray]],
    values: Values,
    link: str,
) -> float:
    """Deviation of a link's white noise, in its unit. At the plant file's numbers too, and what is
    more counts, where a gap has driven one beyond belief.
    """
    # an inertia taken to nothing takes the noise with it that an acceleration brings
    lost = any(
        knob.spread > 0.0
        and abs(values.get(knob.key, knob.value) - knob.value) > LOST * knob.spread
        for knob in subject.nominal
    )
    ready = [subject.prepare(r) for r in recordings]
    variances = [subject.row_variance(one, link) for one in ready]
    at_file = [[subject.residual(one, {}, link) for one in ready]] if lost else []
    return max(
        _white_size(subject, residuals, variances)
        for residuals in ([own[r.name][link] for r in recordings], *at_file)
    )


def _white_size(
    subject: Subject, residuals: Sequence[np.ndarray], variances: Sequence[np.ndarray | None]
) -> float:
    """As ``white_size``, by the rows whose own variance is no more than that."""
    lowpass_hz, rows, noise = min(subject.lowpass_hz, subject.rate_hz), list(residuals), np.inf
    while 0.0 < (size := white_size(rows, subject.rate_hz, lowpass_hz)) < noise:
        noise = size
        rows = [
            x if variance is None else np.where(variance <= noise**2, x, np.nan)
            for x, variance in zip(residuals, variances, strict=True)
        ]
    return noise if noise < np.inf else 0.0


def white(link: str, rms: float, source: str) -> Floor:
    """Noise without colour."""
    return Floor(link, max(rms, LEAST), np.zeros(ORDER), max(rms, LEAST), {}, source)


def fitted(link: str, noise: Sequence[np.ndarray], source: str) -> Floor:
    """Size and colour of stretches of noise, (n,) each; NaN rows part them."""
    covariance = autocovariance(noise, ORDER)
    if covariance[0] <= LEAST**2:
        return Floor(link, LEAST, np.zeros(ORDER), LEAST, {}, source)
    ar, innovation = levinson(covariance)
    return Floor(link, float(np.sqrt(covariance[0])), ar, innovation, {}, source)
