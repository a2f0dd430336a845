"""Which slave is missing, extra, swapped or another: one sentence each."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.identity import Found, device_of, differences
from epa_rt.config.devices import DEVICES
from epa_rt.config.rig import Slave

NAMES = ("EK1100", "EL2124", "EL3004", "EL4034", "EPOS4")
RIG = tuple(
    Slave(name=name, device=device)
    for name, device in zip(
        ("coupler", "valves", "analog_in", "analog_out", "drive"), NAMES, strict=True
    )
)


def found(device: str, revision: int | None = None) -> Found:
    known = DEVICES[device]
    return Found(
        known.vendor,
        known.products[0],
        known.revisions[0] if revision is None else revision,
        device,
    )


def bus(*devices: str) -> list[Found]:
    return [found(device) for device in devices]


def test_the_rigs_own_bus_does_not_differ():
    assert differences(RIG, bus(*NAMES)) == []


@pytest.mark.parametrize("missing", range(5))
def test_a_missing_slave_is_named(missing):
    sentences = differences(RIG, bus(*(NAMES[:missing] + NAMES[missing + 1 :])))
    assert len(sentences) == 1
    assert (
        f"{RIG[missing].name} (slave {missing + 1}, {NAMES[missing]}): it is missing"
        in sentences[0]
    )


def test_nothing_on_the_wire():
    assert differences(RIG, []) == [
        "found no slave at all, expected 5 from coupler (slave 1, EK1100) on"
    ]


def test_an_extra_slave_is_named_with_its_place():
    assert differences(RIG, bus("EK1100", "EL2124", "EL2124", "EL3004", "EL4034", "EPOS4")) == [
        "found EL2124 as slave 3, expected none there: it is extra"
    ]


def test_swapped_slaves_are_both_named():
    first, second = differences(RIG, bus("EK1100", "EL2124", "EL4034", "EL3004", "EPOS4"))
    assert (
        first == "found EL4034 as slave 3, expected analog_in (slave 3, EL3004): slaves are swapped"
    )
    assert (
        second
        == "found EL3004 as slave 4, expected analog_out (slave 4, EL4034): slaves are swapped"
    )


def test_another_device_in_a_slaves_place():
    stranger = Found(0x2, 0x12345678, 1, "EL9999")
    (sentence,) = differences(RIG, [*bus(*NAMES[:2]), stranger, *bus(*NAMES[3:])])
    assert (
        sentence
        == "found an unknown device 'EL9999' (vendor 0x00000002, product 0x12345678) as slave 3, "
        "expected analog_in (slave 3, EL3004)"
    )


def test_a_revision_outside_the_range():
    slaves = bus(*NAMES)
    slaves[2] = found("EL3004", 0x00170000)
    (sentence,) = differences(RIG, slaves)
    assert sentence.startswith(
        "found revision 0x00170000, expected 0x00100000 to 0x00160000 at analog_in (slave 3,"
        " EL3004)"
    )


def test_a_revision_and_a_product_that_the_rig_file_names():
    rig = (*RIG[:4], Slave(name="drive", device="EPOS4", revision=0x01600000, product=0x61500000))
    slaves = bus(*NAMES)
    assert len(differences(rig, slaves)) == 2
    assert differences(rig, [*slaves[:4], Found(0xFB, 0x61500000, 0x01600000)]) == []
    tried = (*RIG[:4], Slave(name="drive", device="EPOS4", revision=0x02000000))
    assert differences(tried, [*slaves[:4], found("EPOS4", 0x02000000)]) == []


@pytest.mark.parametrize(
    ("place", "product", "revision"),
    [
        (0, 0x044C2C52, 0x00000000),
        (0, 0x044C2C52, 0x00100000),
        (4, 0x61500000, 0x01800000),
        (4, 0x69500000, 0x01700000),
    ],
)
def test_revisions_and_products_that_exist_are_accepted(place, product, revision):
    slaves = bus(*NAMES)
    slaves[place] = Found(slaves[place].vendor, product, revision)
    assert differences(RIG, slaves) == []


def test_every_known_product_is_recognised():
    assert {
        device_of(Found(d.vendor, product, 0)) for d in DEVICES.values() for product in d.products
    } == set(DEVICES)


@settings(max_examples=200)
@given(st.lists(st.sampled_from(NAMES), max_size=8))
def test_only_the_rigs_own_order_passes(devices):
    sentences = differences(RIG, bus(*devices))
    assert bool(sentences) == (tuple(devices) != NAMES)
    assert all("\n" not in sentence for sentence in sentences)
