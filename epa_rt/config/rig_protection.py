"""What a rig file must hold so that it protects rig and people, as a list of rules; and the reasons
given under ``unprotected`` for what it leaves out.

A rule that is broken is a Finding. ``unprotected: {NAME: why}`` excuses findings by the name of
their rule or of their row. A run says every excused finding at its start.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from epa_rt.config.rig_protection_rows import ROW_RULES
from epa_rt.config.rig_protection_scales import SCALE_RULES
from epa_rt.config.rig_protection_stops import STOP_RULES
from epa_rt.config.rig_protection_times import TIME_RULES
from epa_rt.config.source import ConfigError, ConfigErrors, Located

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

RULES = (*ROW_RULES, *SCALE_RULES, *STOP_RULES, *TIME_RULES)


@dataclass(frozen=True)
class Finding:
    """A rule that a rig file breaks. ``row`` is the row it speaks of, '' where it is none.
    ``why``: the reason that excuses it, None where none does.
    """

    rule: str
    row: str
    error: ConfigError
    why: str | None

    @property
    def said(self) -> str:
        """The excused finding in words, for screen and log."""
        return f"{self.error.where}: found {self.error.found} (unprotected: {self.why})"


def findings(rig: "Rig", located: Located) -> tuple[Finding, ...]:
    """Every rule that the rig breaks, in the order of the rules, excused or not."""
    return tuple(_findings(rig, located))


def _findings(rig: "Rig", located: Located) -> Iterator[Finding]:
    for rule in RULES:
        for breach in rule.breaches(rig):
            name = f"{breach.row} (rule {rule.name})" if breach.row else f"rule {rule.name}"
            error = ConfigError(
                located.path, located.line(breach.where), name, breach.found, breach.expected
            )
            why = rig.unprotected.get(rule.name) or rig.unprotected.get(breach.row)
            yield Finding(rule.name, breach.row, error, why if rule.excusable else None)


def excused(rig: "Rig", located: Located) -> tuple[Finding, ...]:
    """The findings that ``unprotected`` excuses. Raises ConfigErrors: one ConfigError for each
    finding without a reason, each name that is none, each reason that excuses nothing.
    """
    found = findings(rig, located)
    errors = [finding.error for finding in found if finding.why is None]
    known = {rule.name for rule in RULES if rule.excusable} | {row.name for row in rig.signals}
    used = {name for finding in found if finding.why for name in (finding.rule, finding.row)}
    for name in rig.unprotected:
        where = ("unprotected", name)
        if name not in known:
            rules = ", ".join(sorted(rule.name for rule in RULES if rule.excusable))
            expected = f"the name of a row in signals, or of a rule: {rules}"
            errors.append(located.error(where, f"'{name}'", expected))
        elif name not in used:
            errors.append(
                located.error(where, "a reason that excuses nothing", "no reason without a finding")
            )
    if errors:
        raise ConfigErrors(errors)
    return tuple(finding for finding in found if finding.why is not None)
