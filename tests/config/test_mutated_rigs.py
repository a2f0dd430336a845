"""Whatever `check` calls sound starts; whatever it refuses, it refuses in sentences."""

import copy

import pytest
import yaml
from broken_files import RIGS
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epa_rt.cli.sound_rig import sound_rig
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.experiments.coordinate import possible_loops
from epa_rt.experiments.dry import dry_run
from epa_rt.experiments.experiment import experiment_from
from epa_rt.loop.assembly import assemble
from epa_rt.loop.run import run
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend
from tests.loop.rigging import Memory, Quiet

NAMES = ("bench", "bench_analog", "knee", "mass")
SOUND = {
    name: yaml.safe_load((RIGS / f"{name}.yaml").read_text(encoding="utf-8")) for name in NAMES
}
PLANT = {name: load_plant(RIGS / SOUND[name]["plant"]) for name in NAMES}
WORDS = [
    *("0", "-1", "1e30 s", "1e-9 s", "0 Hz", "0 V", "1 us", "0.25 ms", "2 ms", "1 s", "0 mm/s"),
    *("100 kPa abs", "0 kPa gauge", "5 MPa gauge", "1e-12 mm", "1e9 N", "muscle_force_n"),
    *(True, False, None, 0, 1, -1, 10**9, [], {}, ["0 V", "10 V"], ["5 V", "1 V"]),
]


def places(value, at=()):
    """Every key of a mapping and every item of a list, at any depth."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in inner:
        yield (*at, key)
        if isinstance(item, (dict, list)):
            yield from places(item, (*at, key))


PLACES = {name: sorted(places(data), key=str) for name, data in SOUND.items()}


def changed(value, how):
    """One scalar (or what stands there) changed: scaled, or another word."""
    kind, amount = how
    if kind == "scale" and isinstance(value, (int, float)) and not isinstance(value, bool):
        return type(value)(value * amount)
    if kind == "scale" and isinstance(value, str):
        number, _, unit = value.partition(" ")
        try:
            return f"{float(number) * amount:.9g} {unit}"
        except ValueError:
            return value
    return amount


HOW = st.one_of(
    st.tuples(st.just("scale"), st.sampled_from([-1.0, 0.0, 0.01, 0.5, 0.9, 1.1, 2.0, 100.0])),
    st.tuples(st.just("word"), st.sampled_from(WORDS)),
    st.tuples(st.just("drop"), st.just(None)),
)


@st.composite
def mutated(draw):
    """A delivered rig file with one to three places dropped, scaled or replaced."""
    name = draw(st.sampled_from(NAMES))
    data = copy.deepcopy(SOUND[name])
    for place in draw(st.lists(st.sampled_from(PLACES[name]), min_size=1, max_size=3)):
        how, inner = draw(HOW), data
        try:
            for key in place[:-1]:
                inner = inner[key]
            if how[0] == "drop":
                del inner[place[-1]]
            else:
                inner[place[-1]] = changed(inner[place[-1]], how)
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change took the place away
    return name, yaml.safe_dump(data, sort_keys=False)


@pytest.fixture(scope="module")
def accepted():
    """How many of the drawn files were accepted, so that the property is not an empty one."""
    counts = {"accepted": 0, "refused": 0}
    yield counts
    assert counts["accepted"] >= 10 and counts["refused"] >= 10, counts


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(mutated())
def test_what_check_calls_sound_starts(accepted, file):
    name, text = file
    try:
        rig = sound_rig(parse_yaml(text, "rig.yaml")).rig
    except ConfigError as error:
        accepted["refused"] += 1
        for one in error.errors:
            said = str(one)
            assert said.startswith(f"rig.yaml:{one.line}: ") and said.isprintable(), said
            assert "found " in said and ", expected " in said, said
        return
    accepted["accepted"] += 1
    loop = possible_loops(rig)[0]
    text = f"experiment: any\nloop: {loop}\nphases: [{{name: rest, for: {20 * rig.period_s} s}}]\n"
    experiment = experiment_from(parse_yaml(text, "any.yaml"), rig)
    dry_run(experiment, rig)
    parts = assemble(rig, experiment)
    memory = Memory()
    result = run(
        rig,
        SimBackend(rig, PLANT[name], 1),
        parts.supervisor,
        parts.envelope,
        parts.decoder,
        parts.encoder,
        memory,
        Quiet(stop_at=40),
    )
    assert result.cycles > 0
    assert not any("traceback" in event[3] for event in memory.events), memory.events
