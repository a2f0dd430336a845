"""Reading YAML: data with the line of every key, or a ConfigError; never another exception."""

import pickle
from pathlib import Path

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from epa_rt.config.rig import rig_from
from epa_rt.config.source import ConfigError, ConfigErrors, Located, load_yaml, parse_yaml

ROOT = Path(__file__).resolve().parents[2]
SOUND = (ROOT / "config/rigs/bench.yaml").read_bytes()
yaml_like = st.text("ab:-[]{}&*!|>'\"%@#,?\n\t 01.~\\xU<=\u00e9\ufeff", max_size=60)


def read(content: bytes, folder: Path) -> Located | ConfigError:
    path = folder / "file.yaml"
    path.write_bytes(content)
    try:
        return load_yaml(path)
    except ConfigError as error:
        return error


@settings(max_examples=400)
@given(st.one_of(st.binary(max_size=200), yaml_like.map(str.encode)))
@example(b'a: "\\UFFFFFFFF"')
@example(b"a: !!bool x")
@example(b"a: !!int ''")
@example(b"a: !!float x")
@example(b"a: !!timestamp x")
@example(b"a: !!binary x")
@example(b"a: 2001-99-99")
@example(b"%YAML 1." + b"9" * 5000 + b"\n--- {a: 1}")
@example(b"a: " + b"9" * 5000)
@example(b"? [a]\n: 1")
@example(b"<<: {a: 1}")
@example(b"a: &x [*x]")
@example(b"{" * 1200)
def test_any_bytes_give_data_or_a_config_error(tmp_path_factory, content):
    found = read(content, tmp_path_factory.getbasetemp())
    if isinstance(found, Located):
        assert isinstance(found.data, dict) and all(line >= 1 for line in found.lines.values())
    else:
        assert 1 <= found.line <= content.count(b"\n") + content.count(b"\r") + 2
        assert "\n" not in str(found) and len(found.found) < 210


@settings(max_examples=150)
@given(st.integers(0, len(SOUND) - 1), st.binary(max_size=4), st.integers(0, 6))
def test_a_rig_file_with_any_damage_gives_a_rig_or_a_config_error(tmp_path_factory, at, put, drop):
    found = read(SOUND[:at] + put + SOUND[at + drop :], tmp_path_factory.getbasetemp())
    if isinstance(found, Located):
        try:
            rig_from(found)
        except ConfigError as error:
            assert ", expected " in str(error) and "\n" not in str(error)


@pytest.mark.parametrize(
    "path", sorted(ROOT.glob("config/*/*.yaml")), ids=lambda p: f"{p.parent.name}/{p.name}"
)
def test_delivered_files_read_as_pyyaml_reads_them(path):
    located = load_yaml(path)
    assert located.data == yaml.safe_load(path.read_text(encoding="utf-8"))
    lines = located.text.split("\n")
    for where, line in located.lines.items():
        if where and isinstance(where[-1], str):
            assert where[-1] in lines[line - 1]


def test_line_of_a_place_that_is_missing_is_the_nearest_above():
    located = parse_yaml("a: 1\nb:\n  - c: 2\n  - d: 3\n", "x.yaml")
    assert [
        located.line(w) for w in (("a",), ("b", 1, "d"), ("b", 1, "e"), ("b", 7), ("z",), ())
    ] == [1, 4, 4, 2, 1, 1]
    assert str(located.error(("b", 1, "d"), "x", "y")) == "x.yaml:4: b[1].d: found x, expected y"


def test_a_byte_order_mark_and_windows_lines_are_read(tmp_path):
    found = read("\ufeffa: 1\r\nb: [\r\n  2,\r\n  3]\r\n".encode(), tmp_path)
    assert found.data == {"a": 1, "b": [2, 3]} and found.line(("b", 1)) == 4


def test_a_file_without_permission_is_a_sentence(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "no")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ConfigError, match="without permission"):
        load_yaml(tmp_path / "x.yaml")


def test_an_error_comes_whole_out_of_another_process():
    one = ConfigError("rig.yaml", 3, "rate", "0 Hz", "more")
    for error in (one, ConfigErrors([one, ConfigError("rig.yaml", 4, "", "x", "y")])):
        came = pickle.loads(pickle.dumps(error))
        assert type(came) is type(error) and str(came) == str(error) and came.line == 3
        assert [str(each) for each in came.errors] == [str(each) for each in error.errors]
