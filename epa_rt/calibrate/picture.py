"""Points, line and residuals of a calibration in one SVG that stands alone."""

import html
import math

import numpy as np

from epa_rt.calibrate.calibration import Calibration
from epa_rt.config.calibration_file import SignalCalibration
from epa_rt.report.charts import FONT

WIDTH, HEIGHT, LEFT, RIGHT = 900, 640, 84, 872
_ABOVE, _BELOW = (112, 372), (436, 580)
_STYLE = """text{font-family:%s;font-size:16px;fill:#22262b}.page{fill:#fff}.soft{fill:#5d6570}
.title{font-size:22px;font-weight:700}.tick{font-size:14px;fill:#5d6570}
.frame{fill:none;stroke:#d8dbe0}
.rule{stroke:#eceef1}.zero{stroke:#8a8f98}.line{stroke:#1f5fa8;stroke-width:2;fill:none}
.before{stroke:#8a8f98;stroke-width:2;stroke-dasharray:6 5;fill:none}
.up{fill:#1f5fa8;stroke:#1f5fa8}
.down{fill:#b8560f;stroke:#b8560f}.band{fill:rgba(90,96,106,.20)}text.up,text.down{stroke:none}
@media (prefers-color-scheme:dark){text{fill:#e6e8eb}.page{fill:#15181c}.soft,.tick{fill:#a2a9b3}
.frame{stroke:#3a4048}.rule{stroke:#2a2f36}.line{stroke:#6fadf2}.up{fill:#6fadf2;stroke:#6fadf2}
.down{fill:#ef9650;stroke:#ef9650}.band{fill:rgba(160,168,180,.26)}}"""


class _Frame:
    """A plot's place on the page and its ranges."""

    def __init__(self, rows: tuple[int, int], x: tuple[float, float], y: tuple[float, float]):
        self.top, self.bottom = rows
        self._x, self._y = _wider(*x), _wider(*y)

    def x(self, value: float) -> float:
        low, high = self._x
        return LEFT + (RIGHT - LEFT) * (value - low) / (high - low)

    def y(self, value: float) -> float:
        low, high = self._y
        return self.bottom - (self.bottom - self.top) * (value - low) / (high - low)

    def path(self, x: np.ndarray, y: np.ndarray) -> str:
        return "M" + "L".join(f"{self.x(a):.1f} {self.y(b):.1f}" for a, b in zip(x, y, strict=True))

    def axes(self) -> list[str]:
        parts = []
        for tick in _ticks(*self._y):
            at = self.y(tick)
            kind = "zero" if tick == 0.0 else "rule"
            parts += [
                f'<line class="{kind}" x1="{LEFT}" x2="{RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/>',
                _text(LEFT - 8, at + 5, f"{tick:g}", "tick", "end"),
            ]
        for tick in _ticks(*self._x):
            parts.append(_text(self.x(tick), self.bottom + 20, f"{tick:g}", "tick", "middle"))
        height = self.bottom - self.top
        parts.append(
            f'<rect class="frame" x="{LEFT}" y="{self.top}" width="{RIGHT - LEFT}"'
            f' height="{height}"/>'
        )
        return parts


def calibration_picture(found: Calibration, one: SignalCalibration) -> str:
    """The picture of a calibration that was written."""
    scale, line, f = found.scale, found.line, found.findings
    factor, unit = scale.people
    x = np.array([p.reading for p in found.points])
    y = factor * np.array([p.reference for p in found.points])
    u = factor * np.array(
        [line.k * line.scale * math.hypot(p.reference_u, line.gain * p.reading_u)
         for p in found.points]
    )  # fmt: skip
    residuals = factor * f.residuals
    wide = np.linspace(x.min(), x.max(), 60)
    band = factor * line.k * line.std(wide)
    present = factor * (scale.gain * wide + scale.offset)
    above = _Frame(
        _ABOVE,
        (float(x.min()), float(x.max())),
        (float(min(y.min(), present.min())), float(max(y.max(), present.max()))),
    )
    most = float(max(np.abs(residuals).max() + u.max(), band.max()))
    below = _Frame(_BELOW, (float(x.min()), float(x.max())), (-most, most))
    around = np.concatenate((wide, wide[::-1])), np.concatenate((band, -band[::-1]))
    parts = [
        _text(LEFT, 36, f"Calibration of {one.signal}", "title"),
        _text(LEFT, 64, one.line_words.replace("+-", "± "), "soft"),
        _text(LEFT, 100, f"reference, {unit}"),
        *_key(f.directions),
        *above.axes(),
        f'<path class="before" d="{above.path(wide, present)}"/>',
        f'<path class="line" d="{above.path(wide, factor * line.value(wide))}"/>',
        _text(LEFT, 424, f"residual, {unit} (grey: 95 % band of the line)"),
        f'<path class="band" d="{below.path(*around)}Z"/>',
        *below.axes(),
    ]
    for a, b, r, reach, way in zip(x, y, residuals, u, f.directions, strict=True):
        parts += [
            f'<circle class="{way}" cx="{above.x(a):.1f}" cy="{above.y(b):.1f}" r="4"/>',
            f'<circle class="{way}" cx="{below.x(a):.1f}" cy="{below.y(r):.1f}" r="4"/>',
            f'<line class="{way}" x1="{below.x(a):.1f}" x2="{below.x(a):.1f}"'
            f' y1="{below.y(r - reach):.1f}" y2="{below.y(r + reach):.1f}"/>',
        ]
    parts.append(_text((LEFT + RIGHT) / 2, 626, f"reading, {scale.native}", "tick", "middle"))
    style = _STYLE % FONT.replace('"', "'")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}"'
        f' height="{HEIGHT}"><style>{style}</style><rect class="page" width="{WIDTH}"'
        f' height="{HEIGHT}"/>{"".join(parts)}</svg>\n'
    )


def _key(directions: tuple[str, ...]) -> list[str]:
    parts, x = [], LEFT + 150
    for way, words in (("up", "from below"), ("down", "from above")):
        if way in directions:
            parts += [f'<circle class="{way}" cx="{x}" cy="95" r="4"/>', _text(x + 10, 100, words)]
            x += 120
    for kind, words in (("line", "fitted"), ("before", "rig file until now")):
        parts += [f'<path class="{kind}" d="M{x} 95h26"/>', _text(x + 34, 100, words)]
        x += 110
    return parts


def _wider(low: float, high: float) -> tuple[float, float]:
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _ticks(low: float, high: float) -> list[float]:
    """About five round numbers within a range."""
    rough = (high - low) / 5.0
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(m * size for m in (1.0, 2.0, 5.0, 10.0) if m * size >= rough)
    first, last = math.ceil(low / step), math.floor(high / step)
    return [round(i * step, 12) for i in range(first, last + 1)]


def _text(x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" class="{kind}"'
        f' text-anchor="{anchor}">{html.escape(words)}</text>'
    )
