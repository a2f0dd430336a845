"""EL2124, EL3004 and EL4034 as the facts sheet has them: bits, steps, status, toggle."""

import math

import numpy as np
import pytest
from sim_rigs import NAMES, Driven, edited, rig

from epa_rt.config.devices import DEVICES
from epa_rt.config.ports import MEASURED_PORTS, VALVE_PORTS
from epa_rt.models.ports import SENSORS
from sim_backend.devices import MACHINE, sample_inputs
from sim_backend.wiring import wire_analog_inputs, wire_drive

V = 3276.8


def sample(name_or_rig, t_ns: int = 0, **ports: float) -> dict[str, tuple[int, int]]:
    """Status and value of each analog channel, in counts, for given plant sensors."""
    driven = Driven(name_or_rig)
    values = np.zeros(len(SENSORS.names))
    for name, value in ports.items():
        values[SENSORS.names.index(name)] = value
    image = np.zeros(driven.decoder.size, np.uint8)
    assert sample_inputs(
        image, driven.model._analog, driven.model._drive, driven.model.machine, values, t_ns
    )
    return {
        f"ch{i + 1}": (
            int.from_bytes(image[4 * i : 4 * i + 2].tobytes(), "little"),
            int.from_bytes(image[4 * i + 2 : 4 * i + 4].tobytes(), "little", signed=True),
        )
        for i in range(4)
    }


def test_ports_of_the_rig_file_are_those_of_the_plant():
    assert SENSORS.names == MEASURED_PORTS
    assert {
        f"muscle{m}_{kind}": (m, kind == "exhaust") for m in (0, 1) for kind in ("inlet", "exhaust")
    } == VALVE_PORTS


@pytest.mark.parametrize(
    ("force_n", "volt"), [(0.0, 0.0), (100.0, 2.0), (250.0, 5.0), (-25.0, -0.5), (499.0, 9.98)]
)
def test_a_known_force_is_a_known_voltage_in_twelve_bit_steps(force_n, volt):
    status, counts = sample("bench", force_n=force_n)["ch2"]
    assert counts % 16 == 0 and abs(counts - volt * V) <= 8.0 and status == 0


def test_one_step_is_a_4096th_of_twenty_volts():
    seen = sorted(
        {sample("bench", force_n=force)["ch2"][1] for force in np.linspace(100.0, 101.0, 41)}
    )
    assert len(seen) == 5 and set(np.diff(seen)) == {16} and pytest.approx(20.0 / 4096) == 16 / V


@pytest.mark.parametrize(
    ("force_n", "status", "counts"),
    [
        (499.9, 0x42, 32767),
        (600.0, 0x42, 32767),
        (1e9, 0x42, 32767),
        (-499.9, 0, -32768),
        (-501.0, 0x41, -32768),
        (-1e9, 0x41, -32768),
    ],
)
def test_beyond_ten_volts_the_channel_says_so_and_stays_at_its_end(force_n, status, counts):
    assert sample("bench", force_n=force_n)["ch2"] == (status, counts)


def test_a_pressure_sensor_reads_gauge_and_an_absolute_one_absolute():
    assert sample("bench", muscle0_gauge_pa=500e3)["ch1"][1] == pytest.approx(3.0 * V, abs=8)
    absolute = edited("bench", ("reads: gauge", "reads: absolute"))
    assert sample(absolute, muscle0_gauge_pa=500e3)["ch1"][1] == pytest.approx(
        (1 + 4 * 0.601325) * V, abs=8
    )


def test_what_the_plant_does_is_what_the_codec_reads():
    driven = Driven("knee")
    measured = driven.cycles(3)
    for row in driven.rig.inputs:
        if row.port:
            true = driven.model.sensors[row.port][0] + (
                driven.rig.atmosphere_pa if row.reads else 0.0
            )
            step = abs(measured[row.name] - true)
            assert step <= {"Pa": 1.3e3, "N": 0.25, "rad": 4e-4}[row.si_unit], row.name


def test_a_channel_that_nothing_feeds_stays_at_zero():
    assert sample("bench", force_n=100.0)["ch4"] == (0, 0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("port", SENSORS.names)
def test_a_plant_that_is_no_number_is_never_turned_into_bytes(bad, port):
    driven = Driven("bench")
    values = np.zeros(len(SENSORS.names))
    values[SENSORS.names.index(port)] = bad
    image = np.full(driven.decoder.size, 7, np.uint8)
    assert not sample_inputs(
        image, driven.model._analog, driven.model._drive, driven.model.machine, values, 0
    )
    assert (image == 7).all()


def test_the_toggle_flips_once_per_conversion():
    conversion_ns = round(DEVICES["EL3004"].sampling.conversion_s * 1e9)
    assert conversion_ns == 625_000
    for n in range(6):
        for t_ns in (n * conversion_ns, (n + 1) * conversion_ns - 1):
            assert sample("bench", t_ns=t_ns)["ch1"][0] >> 15 == n & 1


def test_at_a_kilohertz_one_or_two_conversions_fall_into_a_cycle():
    driven = Driven("bench")
    toggles = [driven.model.cycle(bytes(driven.encoder.size))[1] >> 7 for _ in range(1000)]
    rests = sum(a == b for a, b in zip(toggles, toggles[1:], strict=False))
    assert rests == pytest.approx(600, abs=2)  # 1.6 conversions a cycle: two in six of ten
    assert not driven.decoder.stale


def test_a_channel_mapped_without_its_status_is_read_all_the_same():
    on = edited(
        "bench",
        (
            "{name: analog_in, device: EL3004}",
            "{name: analog_in, device: EL3004, inputs: [ch1, ch2]}",
        ),
        ("    stale_after: 20\n", ""),
        ("    stale_after: 20\n", ""),
    )
    assert [int(row["status_byte"]) for row in wire_analog_inputs(on)] == [-1, -1]
    measured = Driven(on).cycles(3)
    assert (
        abs(measured["muscle_pressure_pa"] - on.atmosphere_pa) < 3e3
        and abs(measured["muscle_force_n"]) < 3.0
    )


@pytest.mark.parametrize("name", NAMES)
def test_each_valve_row_switches_its_own_valve(name):
    on = rig(name)
    valves = [row for row in on.outputs if row.port in VALVE_PORTS]
    assert len(valves) == 2 * len(on.muscles)
    for pattern in range(1 << len(valves)):
        driven = Driven(name)
        driven.cycle(**{row.name: float(pattern >> i & 1) for i, row in enumerate(valves)})
        for i, row in enumerate(valves):
            muscle, exhaust = VALVE_PORTS[row.port]
            assert (
                driven.plant_command["exhaust" if exhaust else "inlet"][muscle] == pattern >> i & 1
            )


@pytest.mark.parametrize("name", NAMES)
def test_a_bus_without_power_shuts_the_inlets_and_opens_the_exhausts(name):
    driven = Driven(name)
    driven.model.cycle(bytes(driven.encoder.size))
    for i in range(len(driven.rig.muscles)):
        assert driven.plant_command["inlet"][i] == 0.0 and driven.plant_command["exhaust"][i] == 1.0
    assert driven.plant_command["enabled"] == 0.0


def test_encoder_counts_are_whole_quadcounts_rounded_down():
    driven = Driven("bench")
    values, image = np.zeros(len(SENSORS.names)), np.zeros(driven.decoder.size, np.uint8)
    byte = int(wire_drive(driven.rig)["position_byte"][0])
    for turns, counts in (
        (0.0, 0),
        (1.0, 4096),
        (-1.0, -4096),
        (0.99999 / 4096, 0),
        (1.00001 / 4096, 1),
        (-0.00001 / 4096, -1),
        (1e9, 2**31 - 1),
    ):
        values[0] = turns * 2 * math.pi
        sample_inputs(
            image, driven.model._analog, driven.model._drive, driven.model.machine, values, 0
        )
        assert int.from_bytes(image[byte : byte + 4].tobytes(), "little", signed=True) == counts, (
            turns
        )


def filtered(selection: int, period_s: float, force_n, seconds: float = 0.4) -> np.ndarray:
    """Counts of the force's channel, one for each cycle, for a force over time (s)."""
    on = edited(
        "bench",
        ("period: 1 ms", f"period: {period_s * 1e3:g} ms"),
        (
            "device: EL3004}",
            "device: EL3004, startup: [{object: 0x8000:06, type: u8, value: 1}, {object:"
            f" 0x8000:15, type: u16, value: {selection}}}]}}",
        ),
    )
    analog, drive = wire_analog_inputs(on), wire_drive(on)
    machine, image = np.zeros(1, MACHINE), np.zeros(64, np.uint8)
    values, seen = np.zeros(len(SENSORS.names)), []
    for k in range(round(seconds / period_s)):
        values[SENSORS.names.index("force_n")] = force_n(k * period_s)
        t_ns = round((k + 1) * period_s * 1e9)
        assert sample_inputs(image, analog, drive, machine, values, t_ns)
        seen.append(int.from_bytes(image[6:8].tobytes(), "little", signed=True))
    return np.array(seen)


@pytest.mark.parametrize("period_s", [2e-3, 1e-3, 0.5e-3, 0.25e-3])
@pytest.mark.parametrize(("selection", "window_s"), [(0, 1 / 50), (1, 1 / 60)])
def test_a_fir_filter_is_the_mean_over_a_period_of_its_hum(selection, window_s, period_s):
    step = filtered(selection, period_s, lambda t: 200.0 * (t >= 0.1))
    late = (np.argmax(step > 2.0 * V) + 1) * period_s - 0.1
    assert late == pytest.approx(window_s / 2, abs=period_s + 0.7e-3)
    assert step[-1] == pytest.approx(4.0 * V, abs=16) and step[0] == 0
    hum = filtered(
        selection, period_s, lambda t: 100.0 + 50.0 * math.sin(2 * math.pi * t / window_s)
    )
    # over a window that is no whole number of cycles a little of it is left
    assert np.ptp(hum[len(hum) // 2 :]) <= 0.06 * V


@pytest.mark.parametrize(
    ("selection", "cut_off_hz"),
    [(n, 2 * hz) for n, hz in enumerate((168, 88, 43, 21, 10.5, 5.2, 2.5, 1.2), start=2)],
)
def test_an_iir_filter_is_a_lag_of_its_cut_off(selection, cut_off_hz):
    step = filtered(selection, 0.5e-3, lambda t: 200.0 * (t >= 0.1), 1.0)
    lag_s = 1.0 / (2 * math.pi * cut_off_hz)
    reached = (np.argmax(step > 4.0 * V * (1 - math.exp(-1.0))) + 1) * 0.5e-3 - 0.1
    assert reached == pytest.approx(lag_s, abs=0.05 * lag_s + 0.6e-3)


def test_without_its_enable_object_there_is_no_filter():
    on = edited(
        "bench",
        ("device: EL3004}", "device: EL3004, startup: [{object: 0x8000:15, type: u16, value: 3}]}"),
    )
    for one in (rig("bench"), on):
        analog = wire_analog_inputs(one)
        assert (analog["window_cycles"] == 0.0).all() and (analog["smoothing"] == 1.0).all()
        assert (analog["conversion_ns"] == 625_000).all()


@pytest.mark.parametrize("period_s", [0.5e-3, 0.25e-3])
def test_between_two_conversions_value_and_toggle_stay(period_s):
    on = edited("bench", ("period: 1 ms", f"period: {period_s * 1e3:g} ms"))
    analog, drive = wire_analog_inputs(on), wire_drive(on)
    machine, image = np.zeros(1, MACHINE), np.zeros(64, np.uint8)
    values, seen = np.zeros(len(SENSORS.names)), []
    for k in range(1, 801):
        values[SENSORS.names.index("force_n")] = 0.25 * k
        t_ns = round(k * period_s * 1e9)
        sample_inputs(image, analog, drive, machine, values, t_ns)
        seen.append((t_ns // 625_000, bytes(image[4:8])))
    for (before, old), (now, new) in zip(seen, seen[1:], strict=False):
        assert (old == new) == (before == now)
