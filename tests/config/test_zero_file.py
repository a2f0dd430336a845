"""The zero file: written whole, read back, refused where it is another rig's, carried by a log."""

import os
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.cli.zero import bring_zero, load_rig_source
from epa_rt.config.rig import load_rig, rig_from
from epa_rt.config.source import ConfigError, load_yaml, parse_yaml
from epa_rt.config.zero_file import (
    ZeroFile,
    read_zero,
    with_zero,
    without_zero,
    write_zero,
    zero_path,
)
from epa_rt.loop.referenced import Referenced
from epa_rt.signals.codec import Decoder

ROOT = Path(__file__).resolve().parents[2]
WIRED, BUS = ROOT / "config/rigs/bench_analog.yaml", ROOT / "config/rigs/bench.yaml"
WHEN = "2026-01-31T12:00:00Z"
COUNTS = st.integers(-(2**31), 2**31 - 1)


def zero(**more) -> ZeroFile:
    return ZeroFile(
        **{"rig": "bench_analog", "method": "here", "at": "0 mm", "when": WHEN, "who": "me"} | more
    )


@settings(max_examples=15)
@given(st.floats(-1.0, 1.0), COUNTS, st.one_of(st.none(), COUNTS), st.text(max_size=20))
def test_what_is_written_is_read_back(tmp_path_factory, at_m, offset, end, who):
    path = tmp_path_factory.mktemp("zero") / "bench_analog.zero.yaml"
    written = zero(at=f"{at_m} m", offset=offset if end is not None else 0, end=end, who=who)
    write_zero(path, written)
    read = read_zero(path, "bench_analog")
    assert read.model_copy(update={"at": 0.0}) == written.model_copy(update={"at": 0.0})
    assert read.at == pytest.approx(written.at, abs=1e-11, rel=1e-8)
    assert os.listdir(path.parent) == [path.name]


def test_its_name_stands_beside_the_rigs():
    assert zero_path(Path("config/rigs/bench.yaml")) == Path("config/rigs/bench.zero.yaml")


def test_a_file_that_cannot_be_written_leaves_nothing_half_done(tmp_path):
    path = tmp_path / "x.zero.yaml"
    path.mkdir()
    with pytest.raises(OSError):
        write_zero(path, zero())
    assert os.listdir(tmp_path) == [path.name] and path.is_dir()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("rig: knee\nmethod: here\nat: 0 mm\nwhen: '2026-01-31'\n", "found 'knee'"),
        ("rig: bench_analog\nmethod: here\nat: 0 mm\nwhen: soon\n", "found 'soon'"),
        ("rig: bench_analog\nmethod: here\nat: 0 N\nwhen: '2026-01-31'\n", "at: found '0 N'"),
        ("rig: bench_analog\nmethod: here\n", "at"),
        ("nonsense", "a list or a single value"),
    ],
)
def test_a_damaged_file_or_another_rigs_is_refused(tmp_path, text, found):
    path = tmp_path / "bench_analog.zero.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        read_zero(path, "bench_analog")
    assert found in str(error.value) and str(path) in str(error.value)
    assert read_zero(tmp_path / "none.zero.yaml", "bench_analog") is None


@pytest.mark.parametrize("braces", [False, True])
def test_a_log_carries_the_offset_and_decodes_with_it(braces):
    source = load_yaml(WIRED)
    if braces:
        import json

        source = parse_yaml(json.dumps(source.data), WIRED)
    joined = with_zero(source, zero(offset=9000, end=-9000))
    rig, plain = rig_from(parse_yaml(joined.text, WIRED)), load_rig(WIRED)
    size, name = Decoder(plain).size, plain.motor.position
    moved = Decoder(rig).decode(bytes(size))[name] - Decoder(plain).decode(bytes(size))[name]
    assert moved == pytest.approx(9000 * 0.06283185307 / 77824, rel=1e-9)
    assert rig.applied_zero.who == "me" and rig.applied_zero.when == WHEN
    assert rig.model_copy(update={"applied_zero": None}) == plain
    with pytest.raises(ConfigError):
        with_zero(joined, zero())


def test_a_wired_count_must_be_where_the_last_run_left_it():
    rig = rig_from(with_zero(load_yaml(WIRED), zero(offset=500, end=9000)))
    check, name = Referenced(rig), rig.motor.position
    per_count, band = 0.06283185307 / 77824, rig.motor.zero.end_band
    end = 9500 * per_count
    assert check.refusal({name: end}) is None
    for apart, refused in ((0.99 * band, False), (1.01 * band, True), (-1.01 * band, True)):
        assert (check.refusal({name: end + apart}) is not None) == refused
    cause, signal, text = check.refusal({name: 0.0})
    assert (cause, signal) == ("unreferenced", name) and "epa home" in text
    assert check.refusal({name: float("nan")}) is not None
    assert Referenced(load_rig(WIRED)).refusal({name: 1.0}) is None  # a simulation has no file


def test_a_bus_drive_says_it_by_bit_15():
    check = Referenced(load_rig(BUS))
    assert check.holds({"drive_status_raw": 0x8237})
    assert check.refusal({"drive_status_raw": 0x7FFF})[0] == "unreferenced"


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        (", direction: increasing", "", "method taut_strap without 'direction'"),
        ("distance_max: 40 mm,", "", "method taut_strap without 'distance_max'"),
        ("at: 10.27 mm", "at: 40 mm", "motor.zero.at: found 40 mm, expected a place within -10 to"),
        ("speed: 4 mm/s, dist", "speed: 90 mm/s, dist", "motor.zero.speed: found 90 mm/s"),
        ("at: 10.27 mm", "at: -7 mm", "motor.zero.at: found 3 mm between it and the limit of"),
        ("distance_max: 40 mm", "distance_max: 400 mm", "found 400 mm, expected at most 41 mm"),
        ("distance_max: 40 mm", "distance_max: 40 m", "motor.zero.distance_max: found 40 m, exp"),
        ("force: 20 N}", "force: 20 kN}", "motor.zero.force: found 20 kN, expected below 350 N"),
        ("method: taut_strap", "method: stop, current: 9 A", "motor.zero.current: found 9 A"),
        ("pressure: 300 kPa", "pressure: 790 kPa", "motor.zero.pressure: found"),
        ("method: taut_strap", "method: index", "motor.zero: found method index without 'current'"),
        ("method: taut_strap", "method: stop", "method stop without 'current'"),
        ("method: taut_strap", "method: hope", "motor.zero.method"),
    ],
)
def test_a_zero_section_that_cannot_work_is_refused(old, new, found):
    text = BUS.read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(ConfigError) as error:
        rig_from(parse_yaml(text.replace(old, new, 1), BUS))
    assert found in str(error.value), str(error.value)


INDEX = {
    "method": "index",
    "at": "10 mm",
    "direction": "increasing",
    "speed": "4 mm/s",
    "current": "1 A",
    "force": "20 N",
}


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("bench", {}, ""),
        ("bench", {"distance_max": "2 mm"}, ""),
        ("bench", {"distance_max": "0 mm"}, "motor.zero.distance_max: found 0 m, expected above 0"),
        ("bench", {"direction": None}, "method index without 'direction'"),
        ("bench", {"speed": None}, "method index without 'speed'"),
        ("bench", {"force": None}, "method index without 'force' on a rig that measures one"),
        ("bench", {"speed": "0.01 mm/s"}, "expected at least one rpm of the motor"),
        ("bench", {"speed": "40 mm/s"}, "expected one at which it stops within half a motor turn"),
        ("bench_analog", {}, "'index' on a wired drive"),
    ],
)
def test_homing_by_index_needs_what_watches_it(name, changes, said):
    data = yaml.safe_load((ROOT / f"config/rigs/{name}.yaml").read_text(encoding="utf-8"))
    zero = {key: value for key, value in (INDEX | changes).items() if value is not None}
    data["motor"]["zero"] = zero
    source = parse_yaml(yaml.safe_dump(data), ROOT / f"config/rigs/{name}.yaml")
    if not said:
        assert rig_from(source).motor.zero.method == "index"
        return
    with pytest.raises(ConfigError, match=said):
        rig_from(source)


@pytest.mark.parametrize("after", ["", "more: 1\n"])
def test_a_logs_own_rig_file_gives_back_what_it_was(after):
    source = load_yaml(BUS)
    joined = with_zero(source, zero(rig="bench")).text + after
    assert without_zero(joined).rstrip("\n") == (source.text + after).rstrip("\n")
    assert without_zero(source.text) == source.text


def test_a_logs_own_rig_file_is_refused_where_a_zero_file_counts(tmp_path):
    """Its zero is of the day of that log."""
    path = tmp_path / "bench_analog.yaml"
    path.write_text(with_zero(load_yaml(WIRED), zero(offset=9000, end=-9000)).text)
    with pytest.raises(ConfigError, match="only a log has"):
        load_rig_source(path, with_zero=True)
    assert load_rig_source(path, with_zero=False)[1].applied_zero is not None


def test_a_copy_of_a_rig_file_gets_its_zero_but_for_a_wired_drive(tmp_path):
    rig, copy = tmp_path / "bench.yaml", tmp_path / "copy.yaml"
    own = zero(rig="bench", method="taut_strap")
    write_zero(zero_path(rig), own)
    assert bring_zero(load_rig(BUS), rig, copy) == [str(tmp_path / "copy.zero.yaml")]
    assert read_zero(zero_path(copy), "bench") == own
    write_zero(zero_path(rig), own.model_copy(update={"who": "another"}))
    (said,) = bring_zero(load_rig(BUS), rig, copy)
    assert "was there before" in said and read_zero(zero_path(copy), "bench") == own
    assert bring_zero(load_rig(BUS), None, copy) == []
    (said,) = bring_zero(load_rig(WIRED), rig, tmp_path / "wired.yaml")
    assert "epa home" in said and not (tmp_path / "wired.zero.yaml").exists()
