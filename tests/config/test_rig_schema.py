"""The exported JSON schema takes what the reader takes, and refuses what it does not know."""

import copy
import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from epa_rt.cli.main import main

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def validators(tmp_path_factory):
    folder = tmp_path_factory.mktemp("schema")
    assert main(["schema", "-o", str(folder)]) == 0
    schemas = {
        kind: json.loads((folder / f"{kind}.json").read_text()) for kind in ("rig", "experiment")
    }
    for schema in schemas.values():
        jsonschema.Draft202012Validator.check_schema(schema)
    return {kind: jsonschema.Draft202012Validator(schema) for kind, schema in schemas.items()}


def data(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("kind", ["rig", "experiment"])
def test_delivered_files_are_sound_by_the_schema(validators, kind):
    paths = sorted((ROOT / "config" / f"{kind}s").glob("*.yaml"))
    assert len(paths) >= 4
    for path in paths:
        assert [e.message for e in validators[kind].iter_errors(data(path))] == [], path.name


def places(value, at=()):
    """Every mapping in the data."""
    if isinstance(value, dict):
        yield at
        for key, inner in value.items():
            yield from places(inner, (*at, key))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from places(inner, (*at, i))


@pytest.mark.parametrize(
    ("kind", "name"), [("rig", "knee"), ("rig", "bench_analog"), ("experiment", "identification")]
)
def test_an_unknown_key_is_refused_wherever_it_stands(validators, kind, name):
    sound = data(ROOT / "config" / f"{kind}s" / f"{name}.yaml")
    for place in places(sound):
        if place[-1:] in (("places",), ("repeat",), ("valves",)):
            continue  # their keys are names that the file gives
        broken = copy.deepcopy(sound)
        inner = broken
        for part in place:
            inner = inner[part]
        inner["no_such_key"] = 1
        assert not validators[kind].is_valid(broken), place


def test_bounds_and_kinds_are_in_the_schema(validators):
    for change in (
        {"period": True},
        {"period": None},
        {"bus": []},
        {"muscles": [{}]},
        {"overrun": {"policy": "ignore"}},
        {"atmosphere": "101 kPa"},
        {"safety": {"lost_cycles": 0}},
        {"drive": {"interface": "wire"}},
    ):
        assert not validators["rig"].is_valid(data(ROOT / "config/rigs/bench.yaml") | change), (
            change
        )
