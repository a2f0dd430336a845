"""A wrong file in a slot is named for what it is; a name that is not there gets a neighbour."""

from pathlib import Path

import pytest

from epa_rt.config.kinds import WORDS, expect_kind, kind_of, named
from epa_rt.config.near_names import did_you_mean, nearest
from epa_rt.config.source import ConfigError, load_yaml

CONFIG = Path(__file__).resolve().parents[2] / "config"
FOLDERS = {
    "rigs": "rig",
    "experiments": "experiment",
    "plants": "plant",
    "queues": "queue",
    "studies": "study",
    "imports": "mapping",
    "rigs_foreign": "foreign rig",
    "plants_foreign": "foreign plant",
}


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_shipped_file_is_known_and_refused_in_every_other_slot(folder):
    for path in sorted((CONFIG / folder).glob("*.yaml")):
        if path.name.endswith(".zero.yaml"):
            continue
        source = load_yaml(path)
        assert kind_of(source.data) == FOLDERS[folder], path
        assert named(path) == WORDS[FOLDERS[folder]], path
        for wanted in WORDS:
            if wanted == FOLDERS[folder]:
                expect_kind(source, wanted)
                continue
            with pytest.raises(ConfigError, match="^.*:[0-9]+: ") as refused:
                expect_kind(source, wanted)
            assert refused.value.found == WORDS[FOLDERS[folder]]
            assert refused.value.expected == WORDS[wanted]


def test_a_rig_file_without_bus_or_kind_is_told_so_before_its_other_keys(tmp_path):
    from epa_rt.config.rig import load_rig

    (tmp_path / "rig.yaml").write_text("rig: cart\nrate: 100 Hz\n")
    with pytest.raises(ConfigError, match="^.*rig.yaml:1: found neither 'bus' nor 'kind', exp"):
        load_rig(tmp_path / "rig.yaml")
    for one in ("bus: []", "kind: carriage"):
        (tmp_path / "rig.yaml").write_text(f"rig: cart\n{one}\n")
        with pytest.raises(ConfigError) as error:
            load_rig(tmp_path / "rig.yaml")
        assert "neither" not in str(error.value)


def test_a_log_where_yaml_is_expected_is_called_a_log(tmp_path):
    log = tmp_path / "a.yaml"
    log.write_bytes(b"\x89MCAP0\r\n" + bytes(range(256)))
    with pytest.raises(ConfigError, match="found a log"):
        load_yaml(log)
    assert named(log) == "a log (MCAP)"
    assert named(tmp_path) is None and named(tmp_path / "none") is None


def test_a_misspelt_file_or_folder_is_answered_with_the_one_that_is_there(tmp_path):
    there = tmp_path / "rigs" / "bench.yaml"
    there.parent.mkdir()
    there.write_text("")
    for wrong in (tmp_path / "rigs/bnech.yaml", tmp_path / "rgis/bench.yaml"):
        assert did_you_mean(wrong) == f"; did you mean {there}?"
    for other in ("rigs/nothing_like_it", "rigs/knee.yaml"):
        assert did_you_mean(tmp_path / other) == ""
    assert did_you_mean(Path("/a\0b/c")) == ""
    assert nearest("rnu", ("run", "report")) == "run"
