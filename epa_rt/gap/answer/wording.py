"""What hides in the plant file's own numbers, and what changes within a log, in a sentence."""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Number, Onset


def said_of_moved(moved: Sequence[Number], gap: bool) -> str:
    """What hides in the plant file's own numbers, or may be the ``gap`` itself."""
    begins = "These" if gap else "For that these"
    where = ", beside what is missing or in its place" if gap else ""
    return (
        f"{begins} went further from the plant file than it should be wrong{where}:"
        f" {', '.join(went_to(one) for one in moved)}."
    )


def went_to(moved: Number) -> str:
    """A nominal parameter and where its refit took it; a ratio has no unit to say."""
    return (
        f"{moved.name} to {moved.value:.3g}{'' if moved.unit == '1' else f' {moved.unit}'} (plant"
        f" file: {moved.neutral:.3g})"
    )


def said_of_onset(onset: Onset) -> str:
    """When an effect begins or changes within a log."""
    return (
        f"Within the logs, {onset.effect.replace('_', ' ')} {'changes' if onset.on else 'begins'}"
        f" at about {onset.at_s:.0f} s of {onset.log} ({onset.probability:.2f}): that explains"
        f" {100.0 * onset.explained_share:.0f} % of what is left without it."
    )
