"""A tuning as text of 80 columns."""

import textwrap

from epa_rt.tune.answer import METHOD, Answer
from epa_rt.tune.report.words import Row, compared, decision, gain_rows, margin_rows

WIDTH = 80


def text_of(answer: Answer) -> str:
    """Everything that an operator needs to read before opening the page."""
    r, sets = answer.response, ("present", compared(answer)[0])
    head = (
        f"{answer.rig}, loop {answer.loop.name}: {answer.seconds:.0f} s of trials,"
        f" {len(r.frequency_hz)} frequencies from {r.frequency_hz[0]:.3g} to"
        f" {r.frequency_hz[-1]:.3g} Hz"
    )
    lines = [
        *_wrapped(head),
        *_wrapped(f"response by {METHOD}"),
        *_wrapped(f"wanted: {answer.wanted_from}"),
        *(line for sentence in answer.remarks for line in _wrapped(f"note: {sentence}")),
        "",
        *_table(("gain", *sets), gain_rows(answer)),
        "",
        *_table(("margin", *sets), margin_rows(answer)),
        "",
        *_wrapped(decision(answer)),
        *(_wrapped(f"warning: {answer.warning}") if answer.warning else ()),
    ]
    return "\n".join(lines)


def _wrapped(sentence: str) -> list[str]:
    return textwrap.wrap(sentence, WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _table(head: Row, rows: list[Row]) -> list[str]:
    all_rows = [head, *rows]
    widths = [max(len(row[i]) for row in all_rows) for i in range(3)]
    return [
        f"{a:<{widths[0]}}  {b:>{widths[1]}}  {c:>{widths[2]}}".rstrip() for a, b, c in all_rows
    ]
