"""A rig file that may run: read, protected or excused by a reason, and constructible."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import Located


@dataclass(frozen=True)
class SoundRig:
    """The rig, and what it does without by reason, a sentence each."""

    rig: "Rig"
    unprotected: tuple[str, ...]


def sound_rig(source: "Located") -> SoundRig:
    """The rig of a file for a run. Raises ConfigError, which may hold several sentences."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.rig_protection import excused
    from epa_rt.config.source import ConfigError, ConfigErrors
    from epa_rt.loop.startable import check_startable

    rig = rig_from(source)
    errors: list[ConfigError] = []
    sentences: tuple[str, ...] = ()
    try:
        sentences = tuple(finding.said for finding in excused(rig, source))
    except ConfigError as error:
        errors += error.errors
    try:
        check_startable(rig, source)
    except ConfigError as error:
        errors += error.errors
    if errors:
        raise ConfigErrors(errors)
    return SoundRig(rig, sentences)
