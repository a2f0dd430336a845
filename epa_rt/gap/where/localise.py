"""Where the gap lies: every link's excess over its noise floor, by state region, frequency band and
time.
"""

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.signal import welch

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.likelihood.floor import Floor, left_over
from epa_rt.gap.likelihood.regressors import TURN
from epa_rt.gap.likelihood.significance import significance
from epa_rt.gap.subject import Link, Subject, Values

BANDS_HZ = ((0.0, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 30.0))
BLOCK_S = 10.0
SMALLEST_SHARE = 0.02  # a region with fewer of the samples than this is not judged
STILL = 0.05  # of the speed's own range: slower than this counts as standing
REVERSAL_S = 0.15  # before and after a change of direction
AMPLITUDE_S = 2.0  # over which a motion's amplitude is looked at


def localise(
    subject: Subject, prepared: Mapping[str, object], values: Values, floors: Mapping[str, Floor]
) -> tuple[Place, ...]:
    """Every link with its excess, the most significant first. ``prepared``: recording name to
    ``Subject.prepare``.
    """
    found = [
        _place(subject, link, prepared, values, floors[link.name])
        for link in subject.links
        if link.name in floors
    ]
    return tuple(
        sorted(
            (place for place in found if place is not None), key=lambda place: -place.significance
        )
    )


def _place(
    subject: Subject, link: Link, prepared: Mapping[str, object], values: Values, floor: Floor
) -> Place | None:
    rate = subject.rate_hz
    residuals = {
        name: left_over(subject, one, values, floor, name) for name, one in prepared.items()
    }
    residuals = {name: r for name, r in residuals.items() if np.isfinite(r).any()}
    if not residuals:
        return None
    white = np.concatenate(
        [w[np.isfinite(w)] for w in (floor.whiten(r) for r in residuals.values())]
    )
    if not len(white):  # no stretch is longer than the floor's memory: nothing can be said of it
        return None
    states = {name: subject.features(prepared[name], link.name) for name in residuals}
    everything = np.concatenate(list(residuals.values()))
    rms = float(np.sqrt(np.nanmean(everything**2)))
    return Place(
        block=link.block,
        link=link.name,
        channel=link.channel,
        unit=link.unit,
        rms=rms,
        floor=floor.rms,
        excess=float(np.sqrt(max(rms**2 - floor.rms**2, 0.0))),
        times_floor=rms / floor.rms,
        significance=significance(white) / floor.scatter,
        state=_by_state(residuals, states, floor.rms, rate),
        band_hz=_by_band(residuals, floor, rate),
        time_s=_by_time(residuals, floor.rms, rate),
    )


def regions(states: Mapping[str, np.ndarray], rate_hz: float) -> dict[str, np.ndarray]:
    """Masks (n,) of the regions a person would ask for: direction, standing, reversal, low and high
    of every state, small and large motions.
    """
    found: dict[str, np.ndarray] = {}
    for name, values in states.items():
        finite = values[np.isfinite(values)]
        if finite.size == 0 or np.ptp(finite) == 0.0 or name.endswith(TURN):
            continue
        if name.endswith(("_m_s", "_rad_s")):
            still = STILL * np.percentile(np.abs(finite), 98)
            found[f"{name} > 0"], found[f"{name} < 0"] = values > still, values < -still
            found[f"{name} near 0"] = np.abs(values) <= still
            found[f"reversal of {name}"] = _near_reversal(
                values, still, round(REVERSAL_S * rate_hz)
            )
        else:
            low, high = np.percentile(finite, (33, 67))
            found[f"{name} low"], found[f"{name} high"] = values < low, values > high
            if name.endswith(("_m", "_rad")) and "error" not in name:
                found |= _amplitudes(name, values, round(AMPLITUDE_S * rate_hz))
    return found


def _amplitudes(name: str, place: np.ndarray, window: int) -> dict[str, np.ndarray]:
    """Where a place moves little and much, as thirds of its range over a window; none where it
    always moves as much.
    """
    if not np.isfinite(place).all() or len(place) < window:
        return {}
    swept = maximum_filter1d(place, window) - minimum_filter1d(place, window)
    low, high = np.percentile(swept, (33, 67))
    return (
        {f"amplitude of {name} low": swept <= low, f"amplitude of {name} high": swept >= high}
        if high > 1.2 * low
        else {}
    )


def _near_reversal(speed: np.ndarray, still: float, reach: int) -> np.ndarray:
    direction = np.where(np.abs(speed) > still, np.sign(speed), 0.0)
    moving = np.flatnonzero(direction)
    changes = moving[1:][direction[moving[1:]] != direction[moving[:-1]]]
    near = np.zeros(len(speed), bool)
    for k in changes:
        near[max(k - reach, 0) : k + reach] = True
    return near


def _by_state(residuals, states, floor_rms: float, rate_hz: float) -> dict[str, float]:
    sums: dict[str, list[float]] = {}
    total = 0
    for name, residual in residuals.items():
        judged = np.isfinite(residual)
        total += int(judged.sum())
        for region, inside in regions(states[name], rate_hz).items():
            inside = inside & judged
            entry = sums.setdefault(region, [0.0, 0])
            entry[0] += float(np.sum(residual[inside] ** 2))
            entry[1] += int(inside.sum())
    return {
        region: float(np.sqrt(square / n)) / floor_rms
        for region, (square, n) in sums.items()
        if n > SMALLEST_SHARE * total
    }


def _by_band(residuals, floor: Floor, rate_hz: float) -> dict[str, float]:
    """rms in a band over the floor's rms in the same band, from averaged periodograms; bands the
    data cannot show are left out.
    """
    length = int(min(20.0 * rate_hz, max((_longest(r) for r in residuals.values()), default=0)))
    if length < rate_hz:
        return {}
    spectra = [
        welch(r[start:stop], rate_hz, nperseg=length)[:2]
        for r in residuals.values()
        for start, stop in _stretches(r)
        if stop - start >= length
    ]
    frequency, density = spectra[0][0], np.mean([s[1] for s in spectra], axis=0)
    noise = floor_density(floor, frequency, rate_hz)
    found = {}
    for low, high in BANDS_HZ:
        inside = (frequency >= low) & (frequency < high)
        if inside.sum() >= 2 and noise[inside].sum() > 0.0:
            found[f"{low:g}-{high:g}"] = float(np.sqrt(density[inside].sum() / noise[inside].sum()))
    return found


def floor_density(floor: Floor, frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    """One-sided power density of the floor's autoregressive model, in the link's unit squared per
    hertz.
    """
    lags = np.arange(1, len(floor.ar) + 1)
    response = 1.0 - np.exp(-2j * np.pi * np.outer(frequency_hz, lags) / rate_hz) @ floor.ar
    return 2.0 * floor.innovation**2 / rate_hz / np.abs(response) ** 2


def _stretches(residual: np.ndarray) -> list[tuple[int, int]]:
    judged = np.concatenate([[0], np.isfinite(residual).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(judged))
    return list(zip(edges[::2], edges[1::2], strict=True))


def _longest(residual: np.ndarray) -> int:
    return max((stop - start for start, stop in _stretches(residual)), default=0)


def _by_time(residuals, floor_rms: float, rate_hz: float) -> dict[str, float]:
    found, step = {}, round(BLOCK_S * rate_hz)
    for name, residual in residuals.items():
        for start in range(0, len(residual), step):
            part = residual[start : start + step]
            if np.isfinite(part).sum() > 0.2 * step:
                found[f"{name} {start / rate_hz:.0f}-{(start + len(part)) / rate_hz:.0f}"] = (
                    float(np.sqrt(np.nanmean(part**2))) / floor_rms
                )
    return found
