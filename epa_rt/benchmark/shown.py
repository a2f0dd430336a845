"""The figures as people read them: a table for docs/gap.md, and one line."""

from collections.abc import Sequence

from epa_rt.benchmark.counted import Figure


def table(found: Sequence[Figure]) -> str:
    """The figures as a table for docs/gap.md."""
    lines = ["| Figure | Bar | Found | Count | 95 % interval |", "|---|---|---|---|---|"]
    for f in found:
        value = (
            "-"
            if f.value is None
            else f"{f.value:.1f} s"
            if f.key == "seconds"
            else f"{100 * f.value:.1f} %"
        )
        interval = "" if f.low is None else f"{100 * f.low:.0f}-{100 * f.high:.0f} %"
        lines.append(
            f"| {f.says} | {f.bar} | {value} | {f'{f.right}/' if f.right is not None else ''}{f.of}"
            f" | {interval} |"
        )
    return "\n".join(lines)


def closing_line(found: Sequence[Figure]) -> str:
    """All figures in one line."""
    parts = []
    for f in found:
        if f.value is not None:
            parts.append(
                f"{f.key} {f.value:.0f} s"
                if f.key == "seconds"
                else f"{f.key} {100 * f.value:.0f} % of {f.of}"
            )
    return "; ".join(parts)
