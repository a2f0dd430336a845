"""Rules on reaction times: what the software waits for must be over before the watchdogs act."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from epa_rt.config.rig_protection_rule import Breach, Rule

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

# a valve left open changes a muscle by up to 800 kPa/s: 80 kPa within this time
REACTION_MAX_S = 0.1
# ... and by 200 kPa until the slaves drop their outputs by themselves
WATCHDOG_MAX_S = 0.25
# a drive changes its state within milliseconds, with a brake within a second
TRANSITION_MAX_S = 5.0


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:g} ms"


def _reaction(rig: "Rig") -> Iterator[Breach]:
    safety, master = rig.safety, rig.master
    most = min(REACTION_MAX_S, safety.watchdog)
    if safety.reaction > most:
        yield Breach(
            "",
            ("safety", "reaction"),
            _ms(safety.reaction),
            f"at most {_ms(most)}: a valve left open fills by 80 kPa in {_ms(REACTION_MAX_S)}, and"
            " the slaves' watchdog acts by itself",
        )
    if safety.watchdog > WATCHDOG_MAX_S:
        yield Breach(
            "",
            ("safety", "watchdog"),
            f"a watchdog of {_ms(safety.watchdog)}",
            f"at most {_ms(WATCHDOG_MAX_S)}, in which a valve left open fills by 200 kPa",
        )
    if safety.watchdog < 2.0 * rig.period_s:
        yield Breach(
            "",
            ("safety", "watchdog"),
            f"a watchdog of {_ms(safety.watchdog)}",
            f"at least two periods, {_ms(2.0 * rig.period_s)}",
        )
    if master.states_every > safety.reaction:
        yield Breach(
            "",
            ("master", "states_every"),
            _ms(master.states_every),
            f"at most the reaction time, {_ms(safety.reaction)}",
        )
    timeout = master.frame_timeout
    if timeout is not None and timeout * safety.lost_cycles > safety.reaction:
        yield Breach(
            "",
            ("master", "frame_timeout"),
            f"{safety.lost_cycles} frames of {_ms(timeout)}",
            f"lost frames that fit into the reaction time of {_ms(safety.reaction)}",
        )


def _drive_times(rig: "Rig") -> Iterator[Breach]:
    drive = rig.drive
    key = "transition_timeout" if drive.interface == "cia402" else "enable_delay"
    value = drive.transition_timeout if drive.interface == "cia402" else drive.enable_delay
    if value > TRANSITION_MAX_S:
        yield Breach(
            "",
            ("drive", key),
            f"{value:g} s",
            f"at most {TRANSITION_MAX_S:g} s, which a drive with a brake takes at the longest",
        )


def _overrun(rig: "Rig") -> Iterator[Breach]:
    overrun = rig.overrun
    if overrun.late >= rig.period_s:
        yield Breach(
            "",
            ("overrun", "late"),
            f"{overrun.late:g} s",
            f"less than the period, {_ms(rig.period_s)}: a cycle later than that is a cycle lost",
        )
    waited = overrun.in_a_row * rig.period_s
    if overrun.policy != "count" and waited > rig.safety.watchdog:
        yield Breach(
            "",
            ("overrun", "in_a_row"),
            f"{overrun.in_a_row} late cycles of {_ms(rig.period_s)}",
            f"at most what the watchdog waits, {_ms(rig.safety.watchdog)}",
        )


TIME_RULES = (
    Rule(
        "reaction", _reaction, "`reaction`, `watchdog`, `states_every` and lost frames fit together"
    ),
    Rule("drive_times", _drive_times, "`transition_timeout` and `enable_delay` at most 5 s"),
    Rule(
        "overrun",
        _overrun,
        "`late` below the period; late cycles that stop or trip within the watchdog",
    ),
)
