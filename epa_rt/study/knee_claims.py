"""Claims of 3.3 (Fig. 9), judged on the conditions through the loop; and what the catalogue
adds.
"""

import numpy as np

from epa_rt.study.claims import Claim
from epa_rt.study.knee_study import FOLLOWED_RATIO, Catalogue, Conditions, EqualMotion

SUPPORT = (
    "I^2 is mostly the torque that holds the shank against gravity. A parallel muscle carries part"
    " of that, and more pressure carries more, at every frequency."
)


def knee_claims(found: Conditions) -> list[Claim]:
    asked = found.asked
    several = len(asked.ppam_pa) > 1  # one pressure alone has no order
    saved = {(s, p): found.saved(s, p) for s in asked.spam_pa for p in asked.ppam_pa}
    lowest = min(ratio.min() for _, ratio in saved.values())
    spans = "; ".join(
        f"SPAM {s / 1e3:.0f}, PPAM {p / 1e3:.0f} kPa: {100 * r.min():.0f} to {100 * r.max():.0f} %"
        for (s, p), (_, r) in saved.items()
    )
    swing = np.concatenate([found.swing(s, p)[1] for s, p in asked.conditions])
    rows = [
        Claim(
            "3.3, Fig. 9",
            "For a fixed SPAM the energy is largest without PPAM: adding one saves",
            spans,
            bool(lowest > 0.0),
            SUPPORT if lowest > 0.0 else "",
        ),
        *((_named(found), _depends(found), _always_low(found)) if several else ()),
        Claim(
            "2.3.2",
            "The movement patterns are kept fixed",
            f"achieved swing {100 * swing.min():.0f} to {100 * swing.max():.0f} % of the wanted one"
            " over all conditions and frequencies",
            bool(swing.min() > 0.95 and swing.max() < 1.05),
            "Under one controller the achieved amplitude depends on pressure and frequency, so a"
            " part of any difference in energy is a difference in motion.",
        ),
    ]
    return [row for row in rows if row is not None]


def _crossings(found: Conditions, spam_pa: float) -> str:
    at = found.crossings_hz(spam_pa)
    low, high = found.asked.ppam_pa.min(), found.asked.ppam_pa.max()
    if at.size:
        return "cross at " + ", ".join(f"{hz:.2f} Hz" for hz in at)
    more = found.saved(spam_pa, float(high))[1].mean() > found.saved(spam_pa, float(low))[1].mean()
    return f"{(high if more else low) / 1e3:.0f} kPa saves more at every frequency"


def crossings_at(hz: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Frequencies at which a difference changes its sign, straight in between."""
    at = np.flatnonzero(np.sign(apart[1:]) != np.sign(apart[:-1]))
    return hz[at] + (hz[at + 1] - hz[at]) * apart[at] / (apart[at] - apart[at + 1])


def _named(found: Conditions) -> Claim | None:
    at = np.flatnonzero(np.isclose(found.asked.spam_pa, 185e3))
    if not at.size or not np.allclose(
        (found.asked.ppam_pa.min(), found.asked.ppam_pa.max()), (145e3, 170e3)
    ):
        return None
    spam = float(found.asked.spam_pa[at[0]])
    crossings = found.crossings_hz(spam)
    hz, high = found.saved(spam, float(found.asked.ppam_pa.max()))
    low = found.saved(spam, float(found.asked.ppam_pa.min()))[1]
    holds = bool(
        crossings.size
        and np.abs(crossings - 1.5).min() <= 0.25
        and (high - low)[hz < 1.2].min() > 0.0
        and (high - low)[hz > 1.8].max() < 0.0
    )
    return Claim(
        "3.3, Fig. 9",
        "At SPAM 185 kPa PPAM 170 saves more below 1.5 Hz, 145 more above",
        _crossings(found, spam),
        holds,
        (
            ""
            if holds
            else SUPPORT
            + " A crossing needs a motor that pays for way: a stiffer parallel muscle makes it"
            " travel more, and with a slower gear its own inertia then outweighs the support"
            " (config/plants/knee_geared.yaml, at equal motion)."
        ),
    )


def _depends(found: Conditions) -> Claim:
    each = {float(s): _crossings(found, float(s)) for s in found.asked.spam_pa}
    holds = any("cross" in words for words in each.values())
    return Claim(
        "3.3",
        "For a given SPAM the frequency decides which PPAM pressure saves most",
        "; ".join(f"SPAM {s / 1e3:.0f} kPa: {words}" for s, words in each.items()),
        holds,
        "" if holds else SUPPORT,
    )


def _always_low(found: Conditions) -> Claim:
    low, high = float(found.asked.ppam_pa.min()), float(found.asked.ppam_pa.max())
    always = [
        s
        for s in map(float, found.asked.spam_pa)
        if (found.saved(s, low)[1] > found.saved(s, high)[1]).all()
    ]
    return Claim(
        "3.3, Fig. 9 left",
        f"For one SPAM {low / 1e3:.0f} kPa always saves more than {high / 1e3:.0f} kPa",
        f"at {len(always)} of {len(found.asked.spam_pa)} serial pressures",
        bool(always),
        "" if always else SUPPORT,
    )


def equal_motion_claims(found: EqualMotion) -> list[Claim]:
    """Whether saving and order are those of the pressures, or of different motion."""
    asked, motion = found.asked, found.motion_ratio
    if not (
        np.isfinite(motion).all()
        and motion.min() >= FOLLOWED_RATIO
        and motion.max() <= 2.0 - FOLLOWED_RATIO
    ):
        return [
            Claim(
                "3.3, Fig. 9",
                "PPAM saves also at equal motion (ideal servo; beyond the paper)",
                f"no equal motion: {100 * np.nanmin(motion):.0f} to {100 * np.nanmax(motion):.0f} %"
                " of the wanted swing",
                None,
                "",
            )
        ]
    low, high = float(asked.ppam_pa.min()), float(asked.ppam_pa.max())
    each = [(s, found.saved(s, low), found.saved(s, high)) for s in map(float, asked.spam_pa)]
    words = "; ".join(
        f"SPAM {s / 1e3:.0f}: {100 * a.min():.0f} to {100 * a.max():.0f} % with {low / 1e3:.0f},"
        f" {100 * b.min():.0f} to {100 * b.max():.0f} % with {high / 1e3:.0f} kPa"
        for s, a, b in each
    )
    hz = asked.catalogue_rad_s / (2.0 * np.pi)
    crossings = {s: crossings_at(hz, b - a) for s, a, b in each}
    order = "; ".join(
        f"SPAM {s / 1e3:.0f}: "
        + (f"cross at {', '.join(f'{one:.2f} Hz' for one in at)}" if at.size else "no crossing")
        for s, at in crossings.items()
    )
    falls = any(
        at.size and b[0] > a[0] for at, (_, a, b) in zip(crossings.values(), each, strict=True)
    )
    saves = bool(min(min(a.min(), b.min()) for _, a, b in each) > 0.0)
    first = Claim(
        "3.3, Fig. 9",
        f"PPAM saves also at equal motion ({100 * found.motion_ratio.min():.0f} to"
        f" {100 * found.motion_ratio.max():.0f} % of the wanted swing, ideal servo; beyond the"
        " paper)",
        words,
        saves,
        "So the saving is one of torque, not of motion." if saves else "",
    )
    if low == high:
        return [first]
    return [
        first,
        Claim(
            "3.3, Fig. 9",
            f"At equal motion {high / 1e3:.0f} kPa saves more at low frequency and {low / 1e3:.0f}"
            " kPa more at high (beyond the paper)",
            order,
            falls,
            (
                "A stiffer parallel muscle makes the motor travel more, and its own inertia has to"
                " be paid for."
                if falls
                else SUPPORT
            ),
        ),
    ]


def catalogue_claims(found: Catalogue) -> list[Claim]:
    if len(found.asked.catalogue_rad_s) < 2 or found.effort()[0].size < 2:
        return []
    best = found.best()
    spam, ppam, fixed = found.fixed()
    least = np.array([one[2] for one in best])
    if not np.isfinite(fixed).all():
        return [
            Claim(
                "3.3, 4",
                "Pressures tuned to the frequency save energy (beyond the paper: the whole"
                " catalogue)",
                "no single setting follows the motion at all frequencies",
                None,
                "",
            )
        ]
    more = fixed.sum() / least.sum() - 1.0
    each = ", ".join(
        f"{w / 2 / np.pi:.3g} Hz: {s / 1e3:.0f}/{p / 1e3:.0f}"
        for w, (s, p, _) in zip(found.asked.catalogue_rad_s, best, strict=True)
    )
    return [
        Claim(
            "3.3, 4",
            "Pressures tuned to the frequency save energy (beyond the paper: the whole catalogue)",
            f"best SPAM/PPAM in kPa: {each}; the best fixed setting"
            f" {spam / 1e3:.0f}/{ppam / 1e3:.0f} kPa takes {100 * more:.1f} % more than switching"
            " at each frequency",
            bool(more > 0.01),
            _support(found, best) + _edges(found, best),
        )
    ]


def _support(found: Catalogue, best: list[tuple[float, float, float]]) -> str:
    hz, ppam = found.asked.catalogue_rad_s / (2.0 * np.pi), np.array([row[1] for row in best]) / 1e3
    k = int(ppam.argmax())
    return (
        f"Judged by 1 %. The best parallel pressure is {ppam[0]:.0f} kPa at {hz[0]:.3g} Hz,"
        f" {ppam[k]:.0f} kPa at {hz[k]:.3g} Hz and {ppam[-1]:.0f} kPa at {hz[-1]:.3g} Hz. "
    )


def _edges(found: Catalogue, best: list[tuple[float, float, float]]) -> str:
    axes = (found.asked.catalogue_spam_pa, found.asked.catalogue_ppam_pa)
    at_edge = [
        k
        for k, row in enumerate(best)
        if any(row[i] in (axes[i].min(), axes[i].max()) for i in (0, 1))
    ]
    if not at_edge:
        return ""
    effort = found.effort()
    gains = [float(effort[k][_inner(effort[k])].min() / best[k][2] - 1.0) for k in at_edge]
    return (
        f"{len(at_edge)} of {len(best)} optima lie at the edge of the grid, so the true ones may"
        f" lie beyond; one inside it takes {100 * min(gains):.1f} to {100 * max(gains):.1f} % more."
    )


def _inner(effort: np.ndarray) -> tuple[slice, ...]:
    """Points that are not at the edge of the grid; along an axis too short to have any, all."""
    return tuple(slice(1, -1) if n > 2 else slice(None) for n in effort.shape)
