"""The gap before and after in one picture that stands alone: what was measured, both plants, and
what each leaves.
"""

import html

import numpy as np

from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.report.curves import path, tick_text, ticks
from epa_rt.gap.report.gate import measured_over
from epa_rt.gap.report.traces import BELIEVED, Trace
from epa_rt.gap.report.words import BASELINES, channel_words, named_words, percent
from epa_rt.report.charts import FONT
from epa_rt.report.shown import Shown, number

WIDTH, HEIGHT, LEFT, RIGHT = 1080, 640, 74, 836
FITS = 120  # characters of small print beside each other
_TOP, _BOTTOM = (128, 372), (430, 590)
_STYLE = """text{font-family:%s;font-size:15px;fill:#22262b}.page{fill:#fff}.soft{fill:#5d6570}.title{font-size:23px;font-weight:700}.tick{font-size:13px;fill:#5d6570}
.frame{fill:none;stroke:#d8dbe0}.rule{stroke:#eceef1}path{fill:none;stroke-width:2;stroke-linejoin:round}.measured{stroke:#22262b;stroke-width:4.5;opacity:.45}
.before{stroke:#b8560f}.after{stroke:#1f5fa8}.band{fill:rgba(90,96,106,.24)}rect.before{fill:#b8560f;stroke:none}rect.after{fill:#1f5fa8;stroke:none}
text.before{fill:#b8560f;stroke:none;font-weight:600}text.after{fill:#1f5fa8;stroke:none;font-weight:600}text.big{font-size:34px;font-weight:700}
@media (prefers-color-scheme:dark){text{fill:#e6e8eb}.page{fill:#15181c}.soft,.tick{fill:#a2a9b3}.frame{stroke:#3a4048}.rule{stroke:#2a2f36}.measured{stroke:#f2f3f5}
.before{stroke:#ef9650}.after{stroke:#6fadf2}.band{fill:rgba(160,168,180,.28)}rect.before,text.before{fill:#ef9650}rect.after,text.after{fill:#6fadf2}}"""  # noqa: E501


def gap_picture(diagnosis: Diagnosis, trace: Trace) -> str:
    """An SVG of ``trace`` (a measured channel with both plants): the curves, what each plant
    leaves, and how much is closed.

    Raises KeyError for a trace that has no measured curve (``is_error``).
    """
    scale, apart = Shown().scale(trace.unit), Shown().difference_scale(trace.unit).unit
    by = {kind: scale.of(np.asarray(values, float)) for _, kind, values in trace.lines}
    left = {kind: by["measured"] - by[kind] for kind in ("before", "after")}
    believed = any(BELIEVED in words for words, kind, _ in trace.lines if kind == "before")
    floor, channel = trace.floor * scale.factor, channel_words(trace.title.partition(":")[0])
    parts = [
        _text(
            LEFT,
            40,
            f"{channel.capitalize()}: the rig and its simulation, before and after",
            "title",
        ),
        *_told(diagnosis, believed),
        *_panel(
            trace.t_s,
            [("measured", by["measured"]), ("before", by["before"]), ("after", by["after"])],
            _TOP,
            None,
        ),
        _text(LEFT, 112, f"{channel}, {scale.unit}"),
        *_key(BELIEVED if believed else "refitted"),
        *_panel(trace.t_s, [(kind, left[kind]) for kind in ("before", "after")], _BOTTOM, floor),
        _text(LEFT, 416, f"what is left: rig minus simulation, {apart} (grey: noise, ± 2 rms)"),
        _text((LEFT + RIGHT) / 2, 630, "time, s", "tick", "middle"),
        *_bars(left, floor, apart),
        *_closed(diagnosis, left, floor, trace),
    ]
    style = _STYLE % FONT.replace('"', "'")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}"'
        f' height="{HEIGHT}"><style>{style}</style><rect class="page" width="{WIDTH}"'
        f' height="{HEIGHT}"/>{"".join(parts)}</svg>\n'
    )


def _told(diagnosis: Diagnosis, believed: bool) -> list[str]:
    """What was named and what was done about it, on one line where it fits; what the simulation
    before is, where that is not the plant file as it stands.
    """
    named = (
        f"The diagnosis named {' and '.join(map(named_words, diagnosis.effects)) or 'no effect'}."
    )
    by_it = "with it" if all(effect.who == "rig" for effect in diagnosis.effects) else "accordingly"
    done = (
        f"The plant file was patched {by_it} and the experiment run again."
        if diagnosis.gate
        else f"The plant was patched {by_it} and run again on the recorded commands."
    )
    done = done if believed else f"{done.removesuffix('.')}; before: {BASELINES['refitted']}."
    if len(named) + len(done) < FITS:
        return [_text(LEFT, 66, f"{named} {done}", "soft")]
    return [_text(LEFT, 62, named, "soft"), _text(LEFT, 83, done, "soft")]


def _panel(
    t_s: np.ndarray,
    curves: list[tuple[str, np.ndarray]],
    rows: tuple[int, int],
    floor: float | None,
) -> list[str]:
    top, bottom = rows
    finite = np.concatenate([values[np.isfinite(values)] for _, values in curves])
    least, most = (float(finite.min()), float(finite.max())) if finite.size else (-1.0, 1.0)
    if floor is not None:
        least, most = min(least, -2.0 * floor), max(most, 2.0 * floor)
    margin = 0.06 * (most - least) or 1.0
    y_range, x_range = (least - margin, most + margin), (float(t_s[0]), float(t_s[-1]))
    width, height = RIGHT - LEFT, bottom - top

    def y(value: float) -> float:
        return top + height * (y_range[1] - value) / (y_range[1] - y_range[0])

    parts = (
        []
        if floor is None
        else [
            f'<rect class="band" x="{LEFT}" y="{y(2 * floor):.1f}" width="{width}"'
            f' height="{y(-2 * floor) - y(2 * floor):.1f}"/>'
        ]
    )
    for tick in ticks(*y_range, about=4):
        parts += [
            f'<line class="rule" x1="{LEFT}" x2="{RIGHT}" y1="{y(tick):.1f}" y2="{y(tick):.1f}"/>',
            _text(LEFT - 8, y(tick) + 5, tick_text(tick), "tick", "end"),
        ]
    for tick in ticks(*x_range):
        parts.append(
            _text(
                LEFT + width * (tick - x_range[0]) / (x_range[1] - x_range[0]),
                bottom + 17,
                tick_text(tick),
                "tick",
                "middle",
            )
        )
    lines = "".join(
        f'<path class="{kind}" d="{path(t_s, values, x_range, y_range, width, height)}"/>'
        for kind, values in curves
    )
    return [
        *parts,
        f'<g transform="translate({LEFT} {top})">{lines}</g>',
        f'<rect class="frame" x="{LEFT}" y="{top}" width="{width}" height="{height}"/>',
    ]


def _key(before: str) -> list[str]:
    x, found = RIGHT, []
    for words, kind, wide in (
        ("simulation, patched", "after", 178),
        (f"simulation, {before}", "before", 216),
        ("the rig", "measured", 90),
    ):
        x -= wide
        found += [f'<path class="{kind}" d="M{x} 107h26"/>', _text(x + 32, 112, words)]
    return found


def _bars(left: dict[str, np.ndarray], floor: float, unit: str) -> list[str]:
    """Upright bars of what is left, beside the noise."""
    rms = {kind: float(np.sqrt(np.nanmean(values**2))) for kind, values in left.items()}
    highest, base, x = max(*rms.values(), floor), 590.0, 876
    parts = [_text(x, 416, f"rms of what is left, {unit}")]
    for i, (words, kind, value) in enumerate(
        (
            ("before", "before", rms["before"]),
            ("after", "after", rms["after"]),
            ("noise", "band", floor),
        )
    ):
        tall, at = 132.0 * value / highest, x + 64 * i
        parts += [
            f'<rect class="{kind}" x="{at}" width="44" y="{base - tall:.1f}" height="{tall:.1f}"/>',
            _text(at + 22, base + 17, words, "tick", "middle"),
            _text(at + 22, base - tall - 6, number(value, 2), "tick", "middle"),
        ]
    return parts


def _closed(
    diagnosis: Diagnosis, left: dict[str, np.ndarray], floor: float, trace: Trace
) -> list[str]:
    """The share of this channel's gap that is closed: over all trials where the gate measured it,
    else over what is drawn.
    """
    name = trace.title.partition(":")[0]
    shares = [
        row["achieved_share"]
        for row in (diagnosis.gate or {}).get("channels", ())
        if row["channel"] == name
    ]
    before2, after2 = (float(np.nanmean(left[kind] ** 2)) for kind in ("before", "after"))
    closed = (
        shares[0]
        if shares
        else 1.0 - (after2 - floor**2) / (before2 - floor**2)
        if before2 > floor**2
        else None
    )
    if closed is None:
        return []
    where = measured_over(diagnosis.gate) if shares else "in these seconds"
    return [
        _text(876, 182, percent(closed), "big"),
        _text(876, 208, "of the gap is closed"),
        _text(876, 229, where, "soft"),
    ]


def _text(x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" class="{kind}"'
        f' text-anchor="{anchor}">{html.escape(words)}</text>'
    )
