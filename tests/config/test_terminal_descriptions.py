"""Descriptions of terminals: conversion, what is wrong with one in a rig file, rules of protection
on currents.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.config.rig import Slave, rig_from
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.rig_protection import RULES
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.config.terminal import BITS, Entry
from epa_rt.config.terminals import TERMINALS, register
from epa_rt.signals.image import image_of, struct_format
from epa_rt.signals.scaling import scaling_of
from tests.cli.shell import RIGS
from tests.other_terminals import EDITS, GENERIC, rig_of, text_of


@pytest.mark.parametrize("name", [name for name in TERMINALS if name != "EPOS4"])
def test_entries_are_what_the_process_data_carry(name):
    """Every entry begins at an object that a PDO carries at the same object, in the same size."""
    device = TERMINALS[name]
    assert device.revisions[0] <= device.emulated_revision <= device.revisions[1]
    for outputs, entries in ((True, device.outputs), (False, device.inputs)):
        objects = {
            (mapped.index, mapped.subindex): mapped.bits
            for pdo in device.pdos
            if pdo.is_output == outputs
            for mapped in pdo.entries
        }
        for entry in entries:
            size = objects[entry.index, entry.subindex]
            assert size == entry.bits or size < 8 < entry.bits  # a word made of bits
            low, high = entry.counts
            assert low < high


@given(
    st.sampled_from("bBhHiI"),
    st.floats(1e-6, 1e3),
    st.floats(-1e3, 1e3),
    st.integers(-(1 << 31), (1 << 32) - 1),
)
def test_counts_and_native_values_are_each_others_inverse(code, per_count, offset, count):
    entry = Entry("x", code, "V", per_count, offset=offset)
    back = entry.to_counts(entry.to_native(count))
    assert back == pytest.approx(count, abs=1e-6 * (abs(count) + abs(offset) / per_count + 1))
    assert entry.bits == BITS[code]


@given(st.floats(3.6, 19.99))
def test_a_current_is_the_value_that_its_calibration_says(milliampere):
    rig = rig_of("others_ma")
    row = rig.row("muscle_pressure_pa")
    entry = image_of(rig, False).places[row.entry].entry
    scaling = scaling_of(row, entry, rig)
    count = round(entry.to_counts(milliampere))
    assert scaling.valid_low <= count <= scaling.valid_high
    gauge = (milliampere - 4.0) / 16.0 * 1e6
    assert scaling.to_si(count) == pytest.approx(rig.atmosphere_pa + gauge, abs=1e6 / 32768)


def test_two_terminals_of_one_name_or_identity_are_refused():
    with pytest.raises(ValueError, match="found a second terminal 'EL3004'"):
        register(TERMINALS["EL3004"])
    from dataclasses import replace

    with pytest.raises(ValueError, match="found the product of EL3004 again in EL9999"):
        register(replace(TERMINALS["EL3004"], name="EL9999"))


def test_bits_words_and_gaps_of_a_generic_terminal_stand_where_they_are_said_to():
    text = text_of(
        "others_ma",
        (
            "      inputs:\n        - pdo: 0x1A00\n          entries:\n",
            "      inputs:\n        - pdo: 0x1A08\n          entries:\n"
            '            - {object: "0x6080:01", name: limit_open, type: bit}\n'
            "            - {gap: 7}\n"
            '            - {object: "0x6080:02", type: u8}\n'
            '            - {object: "0x6080:03", name: teeth, type: u32}\n'
            "        - pdo: 0x1A00\n          entries:\n",
        ),
        (
            "  - {name: cmd_drive_control_raw",
            "  - {name: door_open, entry: analog_b.limit_open}\n"
            "  - {name: teeth_raw, entry: analog_b.teeth}\n"
            "  - {name: cmd_drive_control_raw",
        ),
    )
    rig = rig_from(parse_yaml(text, "generic.yaml"))
    image = image_of(rig, outputs=False)
    start, size = image.slices["analog_b"]
    places = {
        name.removeprefix("analog_b."): (place.byte - start, place.bit)
        for name, place in image.places.items()
        if place.slave == "analog_b"
    }
    assert size == 10
    assert places == {"limit_open": (0, 0), "teeth": (2, 0), "a_status": (6, 0), "a": (8, 0)}
    text_format, fields = struct_format(image, {})
    assert fields["analog_b.a"] > fields["analog_b.teeth"]
    assert [e.bits for e in entries_of(rig.slaves[4], False)] == [1, 7, 8, 32, 16, 16]


def breaches(rig, only=None):
    return [b for rule in RULES if only in (None, rule.name) for b in rule.breaches(rig)]


def broken(old: str, new: str, name: str = "others_ma") -> str:
    with pytest.raises(ConfigError) as found:
        rig_from(parse_yaml(text_of(name, (old, new)), "rig.yaml"))
    assert "\n" not in str(found.value)
    return str(found.value)


A = '{object: "0x6000:11", name: a, type: i16, native: [0 V, 10 V], counts: [0, 32768]}'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("product: 0x0C5C3052", "produkt: 0x0C5C3052", "an unknown key 'produkt'"),
        ("      product: 0x0C5C3052\n", "", "the key 'product'"),
        ("[0x00120000, 0x00140000]", "[0x00140000, 0x00120000]", "expected low, high"),
        ("pdo: 0x1A00", "pdo: 0x1600", "found PDO 0x1600 in the inputs"),
        ("type: u16", "type: u8", "found 'a_status' of type u8, expected u16"),
        ("type: i16", "type: f32", "'f32', expected 'bit', 'u8'"),
        (A, A.replace("name: a, ", ""), "found 'a_status' without 'a'"),
        (A, A.replace(", counts: [0, 32768]", ""), "found one of 'native' and 'counts' at a"),
        (A, A.replace("10 V]", "10 mA]"), "two quantities with the same unit"),
        (A, A.replace("[0 V, 10 V]", "[0 parrots, 10 parrots]"), "found unit 'parrots'"),
        (A, A.replace("[0 V, 10 V]", "[1 V, 1 V]"), "two points that coincide"),
        (A, A.replace("[0, 32768]", "[0, 0]"), "two whole numbers [low, high]"),
        (A, A.replace("}", ", shows: [0, 70000]}"), "counts within -32768 to 32767"),
        (A, "{gap: 3}\n            - " + A, "at bit 19 of the process data, expected a whole"),
        (A, "{gap: 3, type: u8}\n            - " + A, "'gap' beside other keys"),
        (A, '{object: "0x6000:11", name: a}', "without 'object' and 'type'"),
        (A, A + "\n            - " + A, "found the entry 'a' twice"),
        (A, A + "\n            - " + A.replace("name: a", "name: b"), "0x6000:11 twice"),
        ("0x6000:11", "0x0000:11", "expected an index above zero"),
        ("device: generic", "device: EL3064", "found a description at an EL3064"),
        ("    terminal:\n", "    terminol:\n", "an unknown key 'terminol'"),
        ("    terminal:\n", "    inputs: [a]\n    terminal:\n", "a part of the process data"),
        (
            "{name: valves, device: EL2024}",
            "{name: valves, device: EL2024, outputs: [ch2, ch1]}",
            "a part of the process data of EL2024, which are fixed",
        ),
        ("entry: analog_b.a", "entry: analog_b._0", "entry"),
        ('object: "0x8000:06", type: u8', 'object: "0x1C13:00", type: u8', "none of the objects"),
    ],
)
def test_a_description_that_is_wrong_is_named_with_its_line(old, new, words):
    assert words in broken(old, new)


def test_a_generic_terminal_without_a_description_is_refused():
    text = text_of("others_ma")
    start = text.index("    terminal:\n")
    end = text.index('    startup: [{object: "0x8000:06"')
    with pytest.raises(ConfigError, match="expected the key 'terminal'"):
        rig_from(parse_yaml(text[:start] + text[end:], "rig.yaml"))
    assert Slave(name="a", device="EL3154").description is TERMINALS["EL3154"]
    assert GENERIC in text


@pytest.mark.parametrize(
    ("valid", "words"),
    [
        ("[3.6 mA, 21 mA]", ""),
        ("[3.8 mA, 20.5 mA]", ""),
        ("[3.5 mA, 21 mA]", "a range within 3.6 to 21 mA"),
        ("[0 mA, 21 mA]", "a range within 3.6 to 21 mA"),
        ("[3.6 mA, 22 mA]", "a range within 3.6 to 21 mA"),
        ("[4.1 mA, 21 mA]", "on a sensor of 4 to 20 mA"),
        ("[3.6 mA, 19 mA]", "on a sensor of 4 to 20 mA"),
    ],
)
def test_a_current_is_valid_within_what_namur_says(valid, words):
    rig = rig_of("others_ma", ("valid: [3.6 mA, 21 mA]", f"valid: {valid}"))
    found = [b.found + ", expected " + b.expected for b in breaches(rig, "valid")]
    assert [words in sentence for sentence in found] == ([True] if words else [])


@pytest.mark.parametrize("name", EDITS)
def test_the_rules_of_protection_know_every_terminal(name):
    assert breaches(rig_of(name)) == []


def test_a_quantity_of_another_unit_says_which_terminal_has_it():
    said = broken("device: EL3154", "device: EL3004")
    assert "found '4 mA', expected a quantity in V, the entry's own unit (mA is for EL3154)" in said
    said = broken("device: EL3064", "device: EL3154", "others")
    assert "found '1 V', expected a quantity in mA" in said and "(V is for EL3004, EL3064)" in said


@pytest.mark.parametrize("unit", ["", ", native: [-10 V, 10 V], counts: [0, 65535]"])
def test_an_output_whose_safe_value_is_not_count_zero_is_refused(unit):
    """A terminal whose master is gone drops to count 0: here that is full speed backwards."""
    text = (RIGS / "bench_analog.yaml").read_text()
    entry = f'{{object: "0x7000:01", name: ch1, type: u16{unit}}}'
    text = text.replace(
        "  - {name: analog_out, device: EL4034}",
        "  - name: analog_out\n    device: generic\n    terminal:\n      product: 1\n"
        "      revisions: [1, 2]\n"
        f"      outputs: [{{pdo: 0x1600, entries: [{entry}]}}]",
    )
    if not unit:
        text = text.replace("[0 V, 4.56 V]", "[32768 count, 47700 count]")
    with pytest.raises(
        ConfigError, match=r"safe: found 0[^,]*, expected the value at (0 V|count 0)"
    ):
        rig_from(parse_yaml(text, RIGS / "bench_analog.yaml"))
