"""Curves as SVG that follows the page's width and its light or dark colours; words and ticks stay
text of the page.
"""

import math

import numpy as np

from epa_rt.gap.report.traces import Trace
from epa_rt.gap.report.words import channel_words, size
from epa_rt.report.downsample import envelope_indices
from epa_rt.report.markup import Html, join, tag
from epa_rt.report.shown import Shown

WIDTH, HEIGHT, MOST = 1000.0, 240.0, 1600


def figure(trace: Trace) -> Html:
    """One trace with its key, ticks and caption."""
    scale = (
        Shown().scale(trace.unit) if not trace.is_error else Shown().difference_scale(trace.unit)
    )
    lines = [
        (words, kind, np.asarray(scale.of(values), float)) for words, kind, values in trace.lines
    ]
    floor = trace.floor * scale.factor
    band = np.full(len(trace.t_s), floor) if trace.band is None else trace.band * scale.factor
    y_range = _range([values for _, _, values in lines], 2.0 * floor if trace.is_error else 0.0)
    key = join(
        [tag("span", words, class_=f"swatch {kind}") for words, kind, _ in lines]
        + [tag("span", _floor_words(trace), class_="swatch floor") if trace.is_error else ""],
        " ",
    )
    caption = join(
        [
            tag("strong", channel_words(trace.title)),
            f", {scale.unit}. {trace.log}; time in s. ",
            key,
            "" if trace.is_error else f" The noise floor is {size(trace.floor, trace.unit)}.",
        ]
    )
    return tag(
        "figure",
        join(
            [
                tag("figcaption", caption),
                frame(trace.t_s, lines, y_range, band if trace.is_error else None),
            ]
        ),
        class_="curves",
    )


def _floor_words(trace: Trace) -> str:
    varies = trace.band is not None and np.ptp(trace.band) > 0.0
    return "noise floor, ± 2 rms" + (" (wide where the log tells little)" if varies else "")


def frame(
    t_s: np.ndarray,
    lines: list[tuple[str, str, np.ndarray]],
    y_range: tuple[float, float],
    band: np.ndarray | None,
) -> Html:
    """The plot itself; ticks as text beside it, so that they stay legible at any width."""
    if not len(t_s):
        return Html("")
    x_range = float(t_s[0]), float(t_s[-1])
    shapes = [_band(t_s, band, x_range, y_range)] if band is not None else []
    shapes += [
        f'<line class="rule" x1="0" x2="{WIDTH:g}" y1="{_y(tick, y_range):.2f}"'
        f' y2="{_y(tick, y_range):.2f}"/>'
        for tick in ticks(*y_range)
    ]
    shapes += [
        f'<path class="{kind}" d="{path(t_s, values, x_range, y_range)}"/>'
        for _, kind, values in lines
    ]
    drawing = Html(
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" preserveAspectRatio="none" role="img"'
        f' aria-label="curves">{"".join(shapes)}</svg>'
    )
    y_labels = join(
        tag("span", tick_text(tick), style=f"top:{100.0 * _y(tick, y_range) / HEIGHT:.2f}%")
        for tick in ticks(*y_range)
    )
    x_labels = join(
        tag(
            "span",
            tick_text(tick),
            style=f"left:{100.0 * (tick - x_range[0]) / max(x_range[1] - x_range[0], 1e-9):.2f}%",
        )
        for tick in ticks(*x_range)
    )
    return tag(
        "div",
        join(
            [
                tag("div", y_labels, class_="y"),
                tag("div", drawing, class_="plot"),
                tag("div", x_labels, class_="x"),
            ]
        ),
        class_="frame",
    )


def path(
    t_s: np.ndarray,
    values: np.ndarray,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    width: float = WIDTH,
    height: float = HEIGHT,
) -> str:
    """The 'd' of a path; a gap where there is no number. Few enough points to draw, with every
    spike kept.
    """
    chosen = envelope_indices(values, MOST)
    x = (t_s[chosen] - x_range[0]) / max(x_range[1] - x_range[0], 1e-9) * width
    y = (y_range[1] - values[chosen]) / (y_range[1] - y_range[0]) * height
    parts, pen_up = [], True
    for a, b in zip(x, y, strict=True):
        if not math.isfinite(b):
            pen_up = True
            continue
        parts.append(f"{'M' if pen_up else 'L'}{a:.1f} {b:.1f}")
        pen_up = False
    return "".join(parts)


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers inside a range."""
    span = high - low
    if not span > 0.0:
        return [low]
    raw = span / about
    decade = 10.0 ** math.floor(math.log10(raw))
    step = next(m * decade for m in (1.0, 2.0, 5.0, 10.0) if m * decade >= raw)
    first = math.ceil(low / step - 1e-9)
    return [0.0 if k == 0 else k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def tick_text(value: float) -> str:
    """A tick as it is written."""
    return f"{value:.6g}".replace("-", "−")


def _range(curves: list[np.ndarray], least: float) -> tuple[float, float]:
    finite = (
        np.concatenate([values[np.isfinite(values)] for values in curves])
        if curves
        else np.zeros(0)
    )
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (-1.0, 1.0)
    low, high = (min(low, -least), max(high, least)) if least else (low, high)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _y(value: float, y_range: tuple[float, float]) -> float:
    return HEIGHT * (y_range[1] - value) / (y_range[1] - y_range[0])


def _band(
    t_s: np.ndarray, band: np.ndarray, x_range: tuple[float, float], y_range: tuple[float, float]
) -> str:
    """Two rms on either side of zero, as far as they are inside the frame."""
    edge = np.minimum(2.0 * band, max(-y_range[0], y_range[1]))
    above, below = (path(t_s, sign * edge, x_range, y_range) for sign in (1.0, -1.0))
    back = "".join(f"L{place}" for place in reversed(below[1:].split("L")))
    return f'<path class="band" d="{above}{back}Z"/>'
