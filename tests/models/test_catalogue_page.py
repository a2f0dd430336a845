"""docs/effects.md is what the catalogue says, and the schema takes the plants that load_plant
takes.
"""

import json
from pathlib import Path

import pytest
import yaml

from epa_rt.models.catalogue_page import page, plant_schema
from epa_rt.models.plant_file import load_plant, save_plant

ROOT = Path(__file__).parents[2]
PLANTS = sorted((ROOT / "config" / "plants").glob("*.yaml"))


def matches(schema: dict, data: object, where: str = "") -> list[str]:
    """What does not fit: the part of JSON schema that a plant's uses."""
    kinds = {
        "object": dict,
        "string": str,
        "integer": int,
        "number": (int, float),
        "null": type(None),
    }
    wanted = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    if not any(isinstance(data, kinds[kind]) for kind in wanted):
        return [f"{where}: found {data!r}, expected {wanted}"]
    if not isinstance(data, dict):
        return []
    unknown = [f"{where}.{key}: unknown" for key in data if key not in schema["properties"]]
    missing = [f"{where}.{key}: missing" for key in schema.get("required", ()) if key not in data]
    inner = [
        line
        for key, value in data.items()
        if key in schema["properties"]
        for line in matches(schema["properties"][key], value, f"{where}.{key}")
    ]
    return unknown + missing + inner


def test_the_page_is_the_catalogue():
    assert (ROOT / "docs" / "effects.md").read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("path", PLANTS, ids=lambda p: p.stem)
def test_schema_takes_plants_as_written_and_as_saved(path, tmp_path):
    save_plant(tmp_path / "saved.yaml", load_plant(path))
    for file in (path, tmp_path / "saved.yaml"):
        assert matches(plant_schema(), yaml.safe_load(file.read_text(encoding="utf-8"))) == []


def test_schema_refuses_what_load_plant_refuses():
    schema = json.loads(json.dumps(plant_schema()))
    assert matches(schema, {"substeps": 2}) and matches(
        schema, {"plant": "x", "gas": {"leak": "1e-4 1/s"}}
    )
    assert matches(schema, {"plant": "x", "drive": {"inertia": 1e-5}}) and matches(
        schema, {"plant": "x", "effects": {"none": {}}}
    )
    assert (
        matches(schema, {"plant": "x", "effects": {"leak": {"muscle1": {"leak": "1e-4 1/s"}}}})
        == []
    )
