"""The rest of a rig whose drive has a loop of its own that is not the one in the plant file.

How a maker closes a drive's loops, and on which counts, nobody outside knows to the noise. A gap
there that nothing explains says nothing of the gas or the braid, whose links are fed with what was
measured; but it hides what free run would say of them, and as long as nothing explains it nothing
is named. So it is left out, and the rest diagnosed by its blocks.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.attribution import Attribution
from epa_rt.gap.coverage import gaps
from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.plausible import strained
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject

# of the drive's excess with the effects that were tried, from which none of them explains it: the
# right law in other words leaves a few percent
STAYS = 0.1
SURE = 0.5  # confidence that a name needs by the blocks alone
WITHOUT_LINK = "without_link"  # what a diagnosis stands on names the link there that was left out
# of it is left: the whole plant has no say (answer.py: as much as where it is no better with a
# name)
UNHEARD = 0.4


class Rest:
    """A subject without one of its links, and without what reaches that: no effect that does is
    asked for, and free run is not heard.
    """

    def __init__(self, subject: Subject, without: str) -> None:
        self._subject, self._without = subject, without
        self.name, self.rate_hz, self.knobs = subject.name, subject.rate_hz, subject.knobs
        self.links = tuple(link for link in subject.links if link.name != without)
        self.nominal = tuple(knob for knob in subject.nominal if self.touched(knob.key))
        self.catalogue = tuple(
            effect
            for effect in subject.catalogue
            if without not in {link for key in effect.knobs for link in subject.touched(key)}
        )
        self.without_stop, self.patched, self.prepare = (
            subject.without_stop,
            subject.patched,
            subject.prepare,
        )
        self.residual, self.features, self.free_run = (
            subject.residual,
            subject.features,
            subject.free_run,
        )
        self.repeats = getattr(subject, "repeats", None)
        self.lowpass_hz = getattr(subject, "lowpass_hz", subject.rate_hz)

    def touched(self, key: str) -> tuple[str, ...]:
        """As Subject.touched, less the link that was left out."""
        return tuple(link for link in self._subject.touched(key) if link != self._without)

    def told(self, recording: Recording) -> bool:
        """Never: commands say nothing of where the motor was."""
        return False


def apart(subject: Subject, found: Attribution, answer: Diagnosis) -> Rest | None:
    """The rest to be diagnosed: where nothing explains the gap, most of it is in the drive's own
    loop, which no effect explains with nominal parameters that a plant file may have (a drive tuned
    otherwise passes for a scale of its current), and other links have one too; not where the motion
    that all are fed with contradicts itself (an encoder that wobbles shows in the drive first).
    """
    own, motion = getattr(subject, "own_loop", (None, None))
    if own is None or answer.verdict != "not_in_catalogue":
        return None
    shows = gaps(found.before, found.after)
    if len(shows) < 2 or shows[0] != own or motion in shows:
        return None
    over, stays = (left.links[own].before - 1.0 for left in (found.before, found.after))
    explained = stays <= STAYS * over and not strained(
        found.selection.base.normal, found.selection.final.normal
    )
    return None if explained else Rest(subject, own)


def joined(answer: Diagnosis, rest: Diagnosis, own: str, unasked: Sequence[str] = ()) -> Diagnosis:
    """What is said of both; the first answer where the rest has no name that its blocks are sure
    of. ``unasked``: effects that were left out with the link.
    """
    if (
        rest.verdict not in ("explained", "partly_explained")
        or min(effect.confidence for effect in rest.effects) < SURE
    ):
        return answer
    drive = tuple(replace(place, block=own) for place in answer.location if place.link == own)[:1]
    at = drive[0].times_floor if drive else np.nan
    says = (
        f"The drive's own loop is not the plant file's ({at:.1f} times its floor), and nothing of"
        f" the catalogue explains how. In the rest, by its blocks alone: {rest.says}"
    )
    effects = tuple(
        replace(effect, confidence=UNHEARD * effect.confidence) for effect in rest.effects
    )
    heard = answer.free_run and replace(
        answer.free_run, nearest=(), told_apart=()
    )  # what came nearest there is not what is named here
    return replace(
        rest,
        verdict="partly_explained",
        says=says,
        effects=effects,
        location=(*drive, *rest.location),
        free_run=heard,
        free_run_location=answer.free_run_location,
        not_tested=tuple(dict.fromkeys((*rest.not_tested, *unasked))),
        remainder=(*(one for one in answer.remainder if one.link == own), *rest.remainder),
    )


def judged_by(diagnosis: Diagnosis, subject: Subject) -> Subject:
    """What a diagnosis judged its names by: the subject, or its rest. A loop that nothing explains
    would drown whatever tells these names apart.
    """
    left_out = diagnosis.inputs.get(WITHOUT_LINK)
    return Rest(subject, left_out) if left_out in {link.name for link in subject.links} else subject
