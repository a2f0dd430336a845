"""The PI loop that steers the cycle to the reference clock, on simulated clocks: no wall clock in
here.
"""

import random

import pytest

from drivers.clock import Edges, ReferenceClock

PERIOD_NS = 1_000_000
LOCKED_RMS_NS = 20_000


def track(
    drift: float,
    off_ns: int,
    cycles: int,
    wake_up_ns: float = 0.0,
    travel_ns: float = 0.0,
    lose: float = 0.0,
):
    """Offsets of the planned edge from where the reference clock wants it, per cycle, and the cycle
    of the lock.

    ``drift``: the reference clock against ours; ``wake_up_ns`` and ``travel_ns``: means of
    exponential delays.
    """
    noise, clock = random.Random(1), ReferenceClock(PERIOD_NS)
    edge, offsets, locked_at = 0, [], None
    start = 987_654_321 * PERIOD_NS + PERIOD_NS // 2 + off_ns
    for cycle in range(cycles):
        late = int(noise.expovariate(1 / wake_up_ns)) if wake_up_ns else 0
        travel = int(noise.expovariate(1 / travel_ns)) if travel_ns else 0
        back = int(noise.expovariate(1 / travel_ns)) if travel_ns else 0
        edge_at_reference = start + round(edge * (1 + drift))
        offsets.append(
            (edge_at_reference - PERIOD_NS // 2 + PERIOD_NS // 2) % PERIOD_NS - PERIOD_NS // 2
        )
        edge += PERIOD_NS
        if noise.random() >= lose:
            edge += clock.step(
                start + round((edge - PERIOD_NS + late + travel) * (1 + drift)),
                late,
                20_000 + travel + back,
            )
        if clock.locked and locked_at is None:
            locked_at = cycle
    return offsets, locked_at


def rms(values):
    return (sum(v * v for v in values) / len(values)) ** 0.5


@pytest.mark.parametrize("drift", [50e-6, -50e-6, 0.0])
@pytest.mark.parametrize("off_ns", [499_999, -500_000, 250_000, 10])
def test_locks_from_500_us_off_at_50_ppm(drift, off_ns):
    offsets, locked_at = track(drift, off_ns, 3000)
    assert locked_at is not None and locked_at < 500
    assert rms(offsets[locked_at:]) < 1_500
    assert abs(offsets[-1]) < 50


@pytest.mark.parametrize("drift", [50e-6, -50e-6])
def test_stays_locked_under_late_wake_ups_and_jittery_frames(drift):
    offsets, locked_at = track(drift, 499_999, 5000, wake_up_ns=60_000, travel_ns=8_000)
    assert locked_at is not None
    assert rms(offsets[locked_at:]) < LOCKED_RMS_NS


def test_lost_frames_do_not_unlock():
    offsets, locked_at = track(50e-6, 300_000, 5000, wake_up_ns=30_000, travel_ns=8_000, lose=0.05)
    assert locked_at is not None
    assert rms(offsets[locked_at:]) < LOCKED_RMS_NS


def test_one_wild_measurement_moves_the_edge_by_a_microsecond():
    clock = ReferenceClock(PERIOD_NS)
    t = 1000 * PERIOD_NS + PERIOD_NS // 2
    for _ in range(600):
        clock.step(t, 0, 20_000)
        t += PERIOD_NS
    assert clock.locked
    assert abs(clock.step(t + 400_000, 0, 20_000)) <= 1_100


def test_a_frame_that_waited_somewhere_is_not_believed():
    clock = ReferenceClock(PERIOD_NS)
    t = 1000 * PERIOD_NS + PERIOD_NS // 2
    for _ in range(600):
        clock.step(t, 0, 20_000)
        t += PERIOD_NS
    before = clock.offset_ns
    assert abs(clock.step(t + 400_000, 0, 900_000)) <= 1
    assert clock.offset_ns == before


def test_corrections_stay_within_a_tenth_of_the_period():
    clock = ReferenceClock(PERIOD_NS)
    t = 1000 * PERIOD_NS
    for _ in range(50):
        assert abs(clock.step(t, 0, 20_000)) <= PERIOD_NS // 10 + 1
        t += PERIOD_NS


def test_a_frame_that_came_again_is_an_old_one():
    clock = ReferenceClock(PERIOD_NS)
    assert clock.is_new(5)
    clock.step(1_000_000, 0, 20_000)
    assert not clock.is_new(1_000_000) and not clock.is_new(999_999)
    assert clock.is_new(1_000_001)


def test_edges_keep_their_grid_and_skip_what_was_missed(monkeypatch):
    now = [0]
    monkeypatch.setattr("drivers.clock.time.monotonic_ns", lambda: now[0])
    monkeypatch.setattr(
        "drivers.clock.time.sleep", lambda s: now.__setitem__(0, now[0] + round(s * 1e9) + 7)
    )
    edges = Edges(1000)
    edges.start()
    assert edges.wait() == (1000, 7)
    edges.mark()
    now[0] += 300
    assert edges.busy_ns() == 300
    assert edges.wait() == (2000, 7)
    now[0] = 5400
    assert edges.wait() == (3000, 2400)  # late; the edges at 4000 and 5000 are gone
    assert edges.wait() == (6000, 7)
    edges.steer(-40)
    assert edges.wait() == (6960, 7)
