"""An experiment file in words."""

from collections.abc import Sequence

from epa_rt.config.experiment import ExperimentFile, PhaseFile, Until
from epa_rt.config.source import parse_yaml, validate
from epa_rt.report.shown import pretty

LOOPS = {
    "motor_position": "motor position",
    "motor_speed": "motor speed",
    "motor_torque": "motor torque",
    "joint_angle": "joint angle",
}
_KEYS = {"mean": "about", "start": "from", "end": "to", "peak_to_peak": "peak to peak"}


def experiment_file(text: str, path: str = "experiment.yaml") -> ExperimentFile:
    """The file as written. Raises ConfigError."""
    return validate(parse_yaml(text, path), ExperimentFile)


def motion_words(phase: PhaseFile) -> str:
    """'random speed: between 1 mm and 27 mm, speed 50 mm/s, ...'; 'hold still' where nothing
    moves.
    """
    if phase.motion is None:
        return "hold still"
    fields = getattr(phase, phase.motion).model_dump()
    parts = [
        f"{_KEYS.get(key, key)} {_written(value, ' and ' if key == 'between' else ' to ')}"
        for key, value in fields.items()
        if value not in (None, ())
    ]
    return f"{phase.motion.replace('_', ' ')}: {', '.join(parts)}"


def valve_words(phase: PhaseFile) -> str:
    """'all: set to $p0'; 'held' in a trial that says nothing."""
    parts = [
        f"{muscle}: {'set to ' + action.set if action.set else action.word.replace('_', ' ')}"
        for muscle, action in phase.valves.items()
    ]
    return "; ".join(parts) or ("held" if phase.trial else "as before")


def end_words(phase: PhaseFile) -> str:
    """What ends the phase."""
    parts = [f"after {phase.lasts}"] if phase.lasts else []
    parts += [until_words(until) for until in phase.until]
    if phase.motion and not phase.lasts:
        parts.insert(0, "motion done")
    return " and ".join(parts) + (f" (at most {phase.timeout})" if phase.timeout else "")


def until_words(until: Until) -> str:
    if until.valves_settled:
        return "valves settled"
    side = f"below {until.below}" if until.below is not None else f"above {until.above}"
    return f"{until.signal} {side}"


def repeat_words(file: ExperimentFile) -> str:
    """'repeated 7 times, with p0 = 460 kPa gauge, 490 kPa gauge, ...' or 'once, with ...'; '' where
    nothing repeats.
    """
    first = f", from repetition {file.first_repetition} on" if file.first_repetition else ""
    if file.repeat:
        times = len(next(iter(file.repeat.values())))
        lists = "; ".join(f"{name} = {', '.join(values)}" for name, values in file.repeat.items())
        return f"{_times(times)}, with {lists}{first}"
    return f"{_times(file.times)}{first}" if file.times else ""


def _times(number: int) -> str:
    return "once" if number == 1 else f"repeated {number} times"


def _written(value: object, between: str) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return (between if len(value) == 2 else ", ").join(pretty(str(part)) for part in value)
    return pretty(str(value))
