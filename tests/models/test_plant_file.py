"""Plant files: read back bit by bit, and every mistake is one sentence with file and line."""

from pathlib import Path

import pytest

from epa_rt.config.source import ConfigError
from epa_rt.models.plant_file import load_plant, save_plant

PLANTS = sorted((Path(__file__).parents[2] / "config" / "plants").glob("*.yaml"))


@pytest.mark.parametrize("path", PLANTS, ids=lambda p: p.stem)
def test_saved_plants_load_to_the_same_bytes(path, tmp_path):
    first = load_plant(path)
    save_plant(tmp_path / "plant.yaml", first)
    again = load_plant(tmp_path / "plant.yaml")
    assert again.params.tobytes() == first.params.tobytes()
    assert (again.name, again.substeps, set(again.effects)) == (
        first.name,
        first.substeps,
        set(first.effects),
    )
    assert first.name == path.stem


def written(tmp_path, text):
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_and_muscles(tmp_path):
    file = load_plant(
        written(
            tmp_path,
            """plant: p
gas: {supply_gauge: 8 bar}
muscle: {braid_length: 20.78 cm}
muscle1: {braid_length_m: 190 mm, present: 0}
effects:
  leak: {leak: 5e-4 1/s}
  braid_maxwell_slip: {slip2_m: 2 mm, muscle0: {slip_ratio: 9 %}}
""",
        )
    )
    p = file.params[0]
    assert p["gas"]["supply_gauge_pa"].tolist() == [8e5, 8e5]
    assert p["muscle"]["braid_length_m"] == pytest.approx([0.2078, 0.19])
    assert p["muscle"]["slip_ratio"] == pytest.approx([0.09, 0.0]) and p["muscle"]["slip2_m"][
        0
    ] == pytest.approx(2e-3)
    assert p["gas"]["leak_per_s"].tolist() == [5e-4, 5e-4] and file.effects == (
        "leak",
        "braid_maxwell_slip",
    )
    assert file.seed == 1


MISTAKES = [
    ("plant: p\nmuscel: {}\n", 2, "muscel"),
    ("plant: p\ndrive:\n  suply: 48 V\n", 3, "suply"),
    ("plant: p\ndrive:\n  supply: 48 A\n", 3, "48 A"),
    ("plant: p\ndrive:\n  supply: 48\n", 3, "without a unit"),
    ("plant: p\ndrive:\n  supply: 4800 V\n", 3, "1 to 100 V"),
    ("plant: p\ndrive:\n\n  supply: nan V\n", 4, "nan"),
    ("plant: p\ngas:\n  leak: 1e-4 1/s\n", 3, "effects: leak"),
    ("plant: p\neffects:\n  leek: {}\n", 3, "leek"),
    ("plant: p\neffects:\n  leak:\n    slip: 9 %\n", 4, "slip"),
    ("plant: p\neffects:\n  leak: 5\n", 3, "a mapping"),
    ("plant: p\nload:\n  viscous: 1 N*s/m\n", 3, "viscous"),  # two rows share the short name
    ("plant: p\nload:\n  kind_code: 0.5\n", 3, "whole number"),
    ("plant: p\nsensors: {seed: -1}\n", 2, "-1"),
    ("plant: p\nsubsteps: 0\n", 2, "substeps"),
    ("plant: p\nsubsteps: two\n", 2, "substeps"),
    ("plant: 5\n", 1, "name"),
    ("drive: {}\n", 1, "name"),
    ("plant: p\ndrive: 7\n", 2, "a mapping"),
]


@pytest.mark.parametrize(("text", "line", "word"), MISTAKES)
def test_mistakes_name_file_line_and_what_was_expected(text, line, word, tmp_path):
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_plant(path)
    said = str(caught.value)
    assert (
        said.startswith(f"{path}:{line}: ")
        and word in said
        and "expected" in said
        and "\n" not in said
    )
