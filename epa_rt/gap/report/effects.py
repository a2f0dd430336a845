"""Which effects, with their parameters and intervals; what else moved; what was not tested."""

from epa_rt.gap.diagnosis import Diagnosis, Named, Number
from epa_rt.gap.report.words import parameter_words, percent, plain
from epa_rt.report.markup import Html, folded, join, note, paragraph, table, tag


def effects(diagnosis: Diagnosis) -> Html:
    """The named effects, best first, each with its numbers; then the nominal parameters that moved."""
    parts = [join(_effect(i, effect) for i, effect in enumerate(diagnosis.effects, 1))]
    if not diagnosis.effects:
        parts = [paragraph("No effect is named.")]
    if diagnosis.nominal_moved:
        parts += [tag("h3", "Nominal parameters that moved with them"), _numbers(diagnosis.nominal_moved, "plant file"),
                  note("A parameter of the plant file is believed to within its own spread; it moves where the logs insist.")]
    return join(parts)


def not_tested(diagnosis: Diagnosis) -> Html:
    """Effects that these logs could not have shown: their absence from the answer says nothing."""
    if not diagnosis.not_tested:
        return paragraph("Every effect of the catalogue would have shown in these logs at typical strength.")
    names = join((tag("li", plain(name)) for name in diagnosis.not_tested))
    return join([paragraph(f"{len(diagnosis.not_tested)} effects of typical strength would not have shown in these logs. "
                           "That they are not named says nothing about whether the rig has them."), tag("ul", names, class_="columns")])


def _effect(rank: int, effect: Named) -> Html:
    family = f", family {effect.family}" if effect.family != effect.name else ""
    head = tag("h3", join([f"{rank}. {plain(effect.name)} ", tag("span", join([tag("code", effect.name), f"{family}, block {effect.block}"]), class_="soft")]))
    sure = paragraph(f"Confidence {percent(effect.confidence)} (how often it stays first in resamples, less three times what its law leaves); explains {effect.gain:,.0f} units of noise (chi-square, on trials left out).")
    parts = [head, sure, _numbers(effect.parameters, "without")]
    if effect.not_separable_from:
        others = ", ".join(map(plain, effect.not_separable_from))
        parts.append(tag("p", join([tag("strong", "Cannot be told apart from "), others, ": these logs fit as well with them."]), class_="warning"))
    return tag("div", join(parts), class_="effect")


def _numbers(numbers: tuple[Number, ...], neutral_words: str) -> Html:
    rows = []
    for one in numbers:
        value, interval, neutral, unit = parameter_words(one)
        rows.append([one.name, value, interval, unit, neutral, _interval(one)])
    return table(["Parameter", "Value", "95 % interval", "Unit", neutral_words.capitalize(), "neutral ┃ and interval ━●━"], rows, (0, 3, 5), "numbers")


def _interval(one: Number) -> Html:
    """The interval on a line that begins or ends at the neutral value."""
    low, high = min(one.low, one.neutral, one.value), max(one.high, one.neutral, one.value)
    span = high - low
    if not span > 0.0:
        return Html("")

    def at(x: float) -> str:
        return f"{100.0 * (x - low) / span:.1f}%"

    width = f"{100.0 * (one.high - one.low) / span:.1f}%"
    marks = (("neutral", f"left:{at(one.neutral)}"), ("range", f"left:{at(one.low)};width:{width}"), ("dot", f"left:{at(one.value)}"))
    return tag("span", join(tag("i", "", class_=name, style=style) for name, style in marks), class_="interval")


def catalogue_note(diagnosis: Diagnosis) -> Html:
    """What was left out of the catalogue by wish."""
    left_out = diagnosis.inputs.get("left_out") or ()
    return folded("Left out of the catalogue", paragraph(", ".join(map(str, left_out)))) if left_out else Html("")
