"""The table of epa scan: generic terminals known by the rig file, strange slaves named below."""

from drivers.identity import Found, device_of
from drivers.scan import Seen
from epa_rt.cli.scan import table
from epa_rt.config.rig import Slave

EPOS4 = Found(0xFB, 0x63500000, 0x01700000, "EPOS4")
STRANGE = Found(2, 0x0C5C3052, 0x00140000, "Analog-In 4Ch 0-10 V, of a rig of others")


def seen(expected=()) -> list[Seen]:
    return [
        Seen(found, device_of(found, expected), "PREOP", "0170h 0000h")
        for found in (EPOS4, STRANGE)
    ]


def generic() -> Slave:
    """The terminal as docs/terminals.md describes it."""
    entry = {"object": "0x6000:11", "name": "ch1", "type": "i16"}
    terminal = {
        "product": STRANGE.product,
        "revisions": [STRANGE.revision, STRANGE.revision],
        "inputs": [{"pdo": 0x1A00, "entries": [entry]}],
    }
    return Slave.model_validate({"name": "analog_in", "device": "generic", "terminal": terminal})


def test_a_strange_slave_is_named_below_and_all_fits():
    lines = table(seen())
    assert all(len(line) <= 80 for line in lines[:3]), lines
    assert "unknown" in lines[2] and STRANGE.name in lines[3]


def test_a_rig_file_makes_its_generic_terminal_known():
    lines = table(seen([generic()]))
    assert len(lines) == 3 and "a generic terminal" in lines[2]
    assert all(len(line) <= 80 for line in lines), lines
