"""docs/bus-faults.md holds every scenario and every kind of fault that the emulator offers."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def table():
    spec = importlib.util.spec_from_file_location("fault_table", ROOT / "scripts/fault_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_holds_every_fault():
    text = (ROOT / "docs/bus-faults.md").read_text(encoding="utf-8")
    assert table().not_on_page(text) == [], "run scripts/fault_table.py again"


def test_a_kind_that_is_not_on_the_page_is_named():
    module = table()
    text = (ROOT / "docs/bus-faults.md").read_text(encoding="utf-8")
    assert "toggle_frozen" in module.not_on_page(text.replace("toggle_frozen", "something"))
