"""docs/terminals.md followed to the letter: its file and its rig text, on the emulated bus."""

import re
import shutil
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location

import pytest
import yaml

from epa_rt.config.rig import rig_from
from epa_rt.config.rig_protection import RULES
from epa_rt.config.source import parse_yaml
from epa_rt.config.terminals import TERMINALS, register
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder, Encoder
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.bus.emulator.bring_up import Wire
from tests.other_terminals import BENCH, ROOT, text_of

PAGE = (ROOT / "docs/terminals.md").read_text(encoding="utf-8")
FILE = re.search(r"write it\s+as\s+`(epa_rt/config/terminals/\w+\.py)`", PAGE)[1]
ANALOG_IN = "  - {name: analog_in, device: EL3004}\n"
MOST_LINES = 100


def block(language: str) -> str:
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return found


def bench_with(analog_in: str, *more: tuple[str, str]) -> str:
    text = BENCH.read_text(encoding="utf-8")
    for old, new in ((ANALOG_IN, analog_in), *more):
        assert old in text
        text = text.replace(old, new, 1)
    return text


@pytest.fixture
def followed(tmp_path):
    """The page's file, written and known while a test runs."""
    path = tmp_path / FILE
    path.parent.mkdir(parents=True)
    path.write_text(block("python"), encoding="utf-8")
    spec = spec_from_file_location(path.stem, path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    register(module.TERMINAL)
    yield module.TERMINAL.name
    del TERMINALS[module.TERMINAL.name]


def brought_up(text: str):
    """A rig's bus in OP, and what its rows read after some cycles with a wire that breaks."""
    rig = rig_from(parse_yaml(text, "bench.yaml"))
    bus = EmulatedBus(rig, load_plant(ROOT / "config/plants/bench.yaml"), lock_step=True)
    wire, decoder, encoder = Wire(bus), Decoder(rig), Encoder(rig)
    for k in range(60):
        if k == 40:
            bus.faults.add("wire_broken", "muscle_pressure_pa")
        inputs, counter = wire.exchange(encoder.safe_raw)
        assert counter == wire.expected_counter
        measured = decoder.decode(inputs)
        if k == 39:
            assert decoder.invalid == decoder.stale == 0
            assert measured["muscle_pressure_pa"] == pytest.approx(rig.atmosphere_pa, abs=1e3)
            assert measured["muscle_force_n"] == pytest.approx(0.0, abs=2.0)
    names = [name for i, name in enumerate(decoder.names) if decoder.invalid >> i & 1]
    assert names == ["muscle_pressure_pa"]
    return decoder.reason(decoder.names.index("muscle_pressure_pa"))


def test_the_file_is_short_and_the_bus_runs_with_it(followed):
    assert len(block("python").splitlines()) < MOST_LINES
    text = bench_with(f"  - {{name: analog_in, device: {followed}}}\n")
    assert brought_up(text).startswith("terminal reports an error")


def test_the_rig_text_does_as_well():
    unipolar = (
        "native: [0 V, 10 V], value: [0 N, 500 N]}\n    valid: [-0.8 V, 9.8 V]\n",
        "native: [1 V, 9 V], value: [0 N, 400 N]}\n    valid: [0.2 V, 9.8 V]\n",
    )
    text = bench_with(block("yaml"), unipolar, ("[-40 N, 350 N]", "[-30 N, 350 N]"))
    assert brought_up(text).startswith("below the sensor's range, broken wire")


def test_a_file_in_the_folder_is_found_by_itself(tmp_path):
    """One file, and nothing else: a copy of the configuration's room reads a rig with it."""
    (tmp_path / "epa_rt").mkdir()
    shutil.copy(ROOT / "epa_rt/__init__.py", tmp_path / "epa_rt")
    shutil.copytree(ROOT / "epa_rt/config", tmp_path / "epa_rt/config")
    path = tmp_path / FILE
    path.write_text(block("python"), encoding="utf-8")
    name = path.stem.upper()
    rig = tmp_path / "bench.yaml"
    rig.write_text(bench_with(f"  - {{name: analog_in, device: {name}}}\n"), encoding="utf-8")
    script = (
        "from epa_rt.config.rig import load_rig;"
        f"print(load_rig({str(rig)!r}).slaves[2].description.name)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout.strip() == name, done.stderr


def test_the_page_lists_the_terminals_that_are_known():
    table = PAGE.split("## Those that are known")[1].split("\n## ")[0]
    listed = re.findall(r"^\| (\w+) \|", table, re.MULTILINE)
    known = sorted(name for name in TERMINALS if name != "EPOS4")
    assert listed[1:] == [*known, "generic"]


def test_the_row_of_the_page_breaks_no_rule():
    shown = re.search(r"\n((?:    [^\n]*\n)+)\nA sound sensor", PAGE)[1]
    data = yaml.safe_load(text_of("others_ma"))
    (row,) = yaml.safe_load(shown)
    assert data["signals"][0]["name"] == row["name"]
    data["signals"][0] = row
    rig = rig_from(parse_yaml(yaml.safe_dump(data, sort_keys=False), "rig.yaml"))
    assert [breach for rule in RULES for breach in rule.breaches(rig)] == []
