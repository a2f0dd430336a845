"""How long a run takes, in words: for the operator before it starts."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epa_rt.experiments.experiment import Experiment


def duration(seconds: float) -> str:
    """'1 h 5 min', '3 min 20 s', '27 s', '2.4 s'."""
    whole = round(seconds)
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60} min"
    if whole >= 60:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole} s" if whole >= 10 else f"{seconds:.1f} s"


def duration_words(experiment: "Experiment") -> str:
    """'about 27 s; longest phase: hold, 10 s'; in the rig's time."""
    longest = max(experiment.phases, key=lambda phase: phase.duration_s)
    return (
        f"about {duration(experiment.duration_s)}; longest phase: {longest.name},"
        f" {duration(longest.duration_s)}"
    )
