"""Freshness by the terminal's toggle."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_decoding import TOGGLE, Bench, edited


def feed(bench: Bench, toggles: list[int]) -> list[int]:
    """The stale mask after each sample; the other channel flips all the time."""
    masks = []
    for k, toggle in enumerate(toggles):
        bench.set("analog_in.ch1", volt=2.0, status=TOGGLE * toggle).set(
            "analog_in.ch2", volt=1.0, status=TOGGLE * (k & 1)
        )
        bench.decode()
        masks.append(bench.decoder.stale)
    return masks


@pytest.mark.parametrize("first", [0, 1])
def test_stale_after_exactly_so_many_cycles_without_a_change(first):
    bench = Bench()
    masks = feed(bench, [first] * 25)
    assert masks == [0] * 20 + [1] * 5  # the first sample is new, whatever its toggle
    assert feed(bench, [1 - first]) == [0]
    assert feed(bench, [1 - first] * 20) == [0] * 19 + [1]


def test_the_second_channel_has_its_own_bit_and_its_own_age():
    bench = Bench()
    for k in range(21):
        bench.set("analog_in.ch1", volt=2.0, status=TOGGLE * (k & 1)).decode()
    assert bench.decoder.stale == 0b10


@pytest.mark.parametrize("period_us", [400, 500, 625, 800, 1000, 1200, 2000, 4000])
def test_a_terminal_that_converts_freely_is_never_stale(period_us):
    bench = Bench(edited("bench", ("period: 1 ms", f"period: {period_us} us")))
    for offset_us in (0, 1, 300, 624):
        masks = feed(bench, [(offset_us + k * period_us) // 625 & 1 for k in range(2000)])
        assert not any(mask & 1 for mask in masks)


def test_an_invalid_sample_ages_no_differently():
    bench = Bench()
    for k in range(30):
        bench.set("analog_in.ch1", volt=0.0, status=0).set(
            "analog_in.ch2", volt=1.0, status=TOGGLE * (k & 1)
        )
        bench.decode()
    assert bench.decoder.invalid == bench.decoder.stale == 1


def test_a_row_that_asks_for_no_freshness_is_never_stale():
    bench = Bench(
        edited(
            "bench",
            (
                "    limits: [60 kPa abs, 800 kPa gauge]\n    stale_after: 20\n",
                "    limits: [60 kPa abs, 800 kPa gauge]\n",
            ),
        )
    )
    assert not any(mask & 1 for mask in feed(bench, [0] * 300))


runs = st.lists(st.tuples(st.sampled_from([0, 0, 0, 1, 2, 3, 3]), st.integers(1, 24)), max_size=12)


@settings(max_examples=60)
@given(runs)
def test_each_channel_counts_its_own_cycles_whichever_toggle(runs):
    """Channels that toggle together, alone or not at all; the ages are counted one by one here."""
    bench, toggles, ages = Bench(), [0, 0], [-1, -1]  # the first sample is new
    for which, cycles in runs:
        for _ in range(cycles):
            first = ages == [-1, -1]
            for channel in (0, 1):
                new = bool(which >> channel & 1)
                toggles[channel] ^= new
                ages[channel] = 0 if new or first else ages[channel] + 1
                bench.set(f"analog_in.ch{channel + 1}", volt=2.0, status=TOGGLE * toggles[channel])
            bench.decode()
            assert bench.decoder.stale == sum((ages[k] >= 20) << k for k in (0, 1))
