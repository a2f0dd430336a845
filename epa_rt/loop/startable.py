"""Whether a run on a rig would start: everything that assemble() constructs, constructed once for
each loop that the rig can do.
"""

from epa_rt.config.rig import Rig
from epa_rt.config.source import Located, Location, parse_yaml
from epa_rt.experiments.coordinate import possible_loops
from epa_rt.experiments.experiment import experiment_from
from epa_rt.loop.assembly import VALVE_FIELDS, WiringError, assemble, valve_settings

_PROBE = "experiment: probe\nloop: {loop}\nphases:\n  - {{name: hold, for: {seconds} s}}\n"


def check_startable(rig: Rig, located: Located) -> None:
    """Raises ConfigError for the first section of the rig file whose controller refuses it."""
    for i, muscle in enumerate(rig.muscles):
        try:
            valve_settings(muscle, rig)
        except ValueError as error:
            field, found, expected = _parts(str(error))
            place: Location = ("muscles", i, *_valve_key(f"{field} {expected}"))
            raise located.error(place, f"{field} = {found}", expected) from None
    for loop in possible_loops(rig):
        text = _PROBE.format(loop=loop, seconds=10.0 * rig.period_s)
        section = ("joint", "pid") if loop == "joint_angle" else ("motor",)
        try:
            assemble(rig, experiment_from(parse_yaml(text, located.path), rig))
        except WiringError as error:
            raise located.error(section, str(error), f"a rig on which {loop} can run") from None
        except ValueError as error:
            field, found, expected = _parts(str(error))
            raise located.error(section, f"{field} = {found} ({loop})", expected) from None


def _valve_key(sentence: str) -> tuple[str, ...]:
    """Where the file holds the first field that a sentence of ValveSettings names."""
    for word in sentence.split():
        if word == "over_pressure_pa":
            return ("pressure_max",)
        for key, field in VALVE_FIELDS.items():
            if word == field:
                return ("valves", key)
    return ("valves",)


def _parts(sentence: str) -> tuple[str, str, str]:
    """Name, found and expected of 'NAME: found X, expected Y'."""
    name, _, rest = sentence.partition(": found ")
    found, _, expected = rest.partition(", expected ")
    return name, found or "what its controller refuses", expected or "another value"
