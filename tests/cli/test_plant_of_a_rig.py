"""A plant file that is another rig's is refused before anything moves, by the verbs that run and by
those that diagnose.
"""

import pytest

from epa_rt.cli.inputs import load_plant_of
from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig, rig_from
from epa_rt.config.source import ConfigError, parse_yaml
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT

PLANTS = ROOT / "config/plants"
CASES = [
    (
        "bench",
        "knee",
        (
            "knee.yaml:30: load.kind_code: found a joint (kind_code 2), a plant of another rig,"
            " expected a muscle held by the load cell (kind_code 0)"
        ),
    ),
    ("bench", "mass", "mass.yaml:36: load.kind_code: found a mass on a line"),
    (
        "knee",
        "bench",
        (
            "bench.yaml:40: load.kind_code: found a muscle held by the load cell (kind_code 0), a"
            " plant of another rig, expected a joint (kind_code 2)"
        ),
    ),
]


@pytest.mark.parametrize("rig, plant, words", CASES)
def test_a_run_refuses_a_plant_of_another_rig_in_one_sentence(rig, plant, words, tmp_path, capsys):
    experiment = (
        EXPERIMENTS / {"bench": "identification_short.yaml", "knee": "knee_chirp_short.yaml"}[rig]
    )
    assert (
        main(
            [
                "run",
                str(experiment),
                "--rig",
                str(RIGS / f"{rig}.yaml"),
                "--plant",
                str(PLANTS / f"{plant}.yaml"),
                "-o",
                str(tmp_path / "out"),
            ]
        )
        == 2
    )
    found = capsys.readouterr()
    assert (
        words in found.err
        and found.err.endswith(f"which the rig '{rig}' has\n")
        and found.err.count("\n") == 1
        and not found.out
    )
    assert not (tmp_path / "out").exists()


def test_an_emulated_bus_refuses_it_too(capsys):
    assert (
        main(
            [
                "bus",
                "serve",
                "--rig",
                str(RIGS / "bench.yaml"),
                "--interface",
                "none",
                "--plant",
                str(PLANTS / "mass.yaml"),
            ]
        )
        == 2
    )
    assert "a plant of another rig" in capsys.readouterr().err
    assert main(["bus", "serve", "--rig", str(RIGS / "bench.yaml"), "--interface", "none"]) == 4, (
        "its own plant is served, had it an interface"
    )


def test_every_rig_takes_its_own_plant():
    for path in RIGS.glob("*.yaml"):
        load_plant_of(path, load_rig(path), None)


def test_a_plant_that_lacks_a_muscle_of_the_rig(tmp_path):
    text = (PLANTS / "knee.yaml").read_text(encoding="utf-8")
    (tmp_path / "one.yaml").write_text(text + "\nmuscle1:\n  present: 0\n", encoding="utf-8")
    with pytest.raises(
        ConfigError, match="found a plant with 1 muscle, expected 2, which the rig 'knee' has"
    ):
        load_plant_of(RIGS / "knee.yaml", load_rig(RIGS / "knee.yaml"), tmp_path / "one.yaml")


def test_a_rig_that_does_not_measure_its_load_has_the_load_of_the_plant_it_names(tmp_path):
    """A mass whose distance sensor no plant can feed looks like a bench; only the plant that it
    names tells.
    """
    text = (RIGS / "mass.yaml").read_text(encoding="utf-8")
    blind = rig_from(parse_yaml(text.replace("    port: load_position_m\n", ""), "mass.yaml"))
    load_plant_of(RIGS / "mass.yaml", blind, PLANTS / "serial.yaml")
    with pytest.raises(
        ConfigError, match="found a muscle held by the load cell .* expected a mass on a line"
    ):
        load_plant_of(RIGS / "mass.yaml", blind, PLANTS / "bench.yaml")
    load_plant_of(
        tmp_path / "rig.yaml", blind, PLANTS / "bench.yaml"
    )  # its own plant is not there: nothing tells


def test_a_plant_is_read_once(monkeypatch):
    from epa_rt.cli.gap.inputs import open_rig
    from epa_rt.models import plant_file

    read, seen = plant_file.read_plant, []
    monkeypatch.setattr(
        plant_file, "read_plant", lambda source: seen.append(source.path) or read(source)
    )
    open_rig(RIGS / "bench.yaml", None)
    assert len(seen) == 1
