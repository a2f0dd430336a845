"""The menu of a component rig: what could be run next, and how its plant would answer."""

from dataclasses import replace

import numpy as np
import yaml

from epa_rt.config.source import parse_yaml
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.foreign.component import Experiment
from epa_rt.gap.rig.foreign.plant_file import read_plant
from epa_rt.gap.rig.foreign.readings import as_read
from epa_rt.gap.rig.foreign.subject import ForeignSubject
from epa_rt.gap.rig.menu import Item


def items(subject: ForeignSubject) -> tuple[Item, ...]:
    """The menu as ``plan.next_experiment`` takes it; empty where this kind has no model of the
    whole.

    ``text`` is the commanded profile itself, by which whoever drives that rig can run it; ``epa
    run`` drives none but ours.
    """
    return tuple(
        Item(one.name, one.settings, _text(subject, one), one.says) for one in subject.menu()
    )


def simulated(
    subject: ForeignSubject, item: Item, plant_text: str, like: Recording, seed: int = 1
) -> Recording | None:
    """The recording that a plant (text of its file) would make of an experiment, as noisy as
    ``like``; None for an unknown one.

    Raises ConfigError where the text is no plant file of this rig, KeyError where ``like`` lacks a
    column that the rig file names.
    """
    one = next(
        (e for e in subject.menu() if e.name == item.name and e.settings == item.settings), None
    )
    if one is None or subject.rig.component.free_run is None:
        return None
    plant = read_plant(parse_yaml(plant_text, "plant.yaml"), subject.rig)
    runner = ForeignSubject(subject.rig, plant)
    blank = _commanded(subject, one)
    clean = runner.free_run(blank, {}, None)
    known, rng = subject.prepare(like).signals, np.random.default_rng(seed)
    columns = dict(clean.columns)
    for role, name in subject.rig.channels.items():
        if name in columns and name not in _command_names(subject, one):
            columns[name] = as_read(columns[name], known, role, subject.rig, rng)
    return replace(clean, columns=columns)


def _command_names(subject: ForeignSubject, one: Experiment) -> set[str]:
    return {subject.rig.channels[role] for role in one.commands}


def _commanded(subject: ForeignSubject, one: Experiment) -> Recording:
    """A recording with the commands alone; measured columns are NaN."""
    count = len(next(iter(one.commands.values())))
    columns = {
        name: np.full(count, np.nan)
        for role, name in subject.rig.channels.items()
        if role not in _optional(subject)
    }
    columns |= {
        subject.rig.channels[role]: np.asarray(values, float)
        for role, values in one.commands.items()
    }
    name = " ".join([one.name, *one.settings.values()])
    return Recording(
        name,
        "",
        subject.name,
        subject.plant.name,
        one.name,
        1.0 / one.rate_hz,
        np.arange(count),
        columns,
        (Span(one.name, 0, count, True),),
    )


def _optional(subject: ForeignSubject) -> set[str]:
    return {channel.role for channel in subject.rig.component.channels if not channel.required}


def _text(subject: ForeignSubject, one: Experiment) -> str:
    """The profile as YAML: settings, and every command with its samples."""
    units = {channel.role: channel.unit for channel in subject.rig.component.channels}
    said = {
        role: {"unit": units[role], "samples": [round(float(v), 6) for v in values]}
        for role, values in one.commands.items()
        if np.ptp(values) > 0.0
    }
    text = {
        "experiment": one.name,
        "rig": subject.name,
        "says": one.says,
        "settings": one.settings,
        "rate": f"{one.rate_hz:g} Hz",
        "commands": said,
    }
    return yaml.safe_dump(text, sort_keys=False, default_flow_style=None, width=4000)
