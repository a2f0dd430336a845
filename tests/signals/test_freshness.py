"""Freshness by the terminal's toggle."""

import pytest
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
