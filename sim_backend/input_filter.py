"""The input filter of analog terminals: what its settings mean, and a record of one channel.

Sources: Beckhoff documentation of EL30xx (FIR and IIR filter: 0x8000:06 and 0x8000:15 set it for
all channels) and of EL31xx (conversion times of the same filter).
"""

import math

import numpy as np

from epa_rt.config.rig import Slave

FILTER_RING = 256  # cycles that a channel remembers: 20 ms at the shortest period, 0.1 ms
NO_FILTER = -1
ENABLE_OBJECT, SELECT_OBJECT = (0x8000, 0x06), (0x8000, 0x15)

ANALOG_IN = np.dtype(
    [
        ("slave", "i8"),  # number of the terminal in the rig's bus
        ("status_byte", "i8"),
        ("value_byte", "i8"),
        ("value_size", "i8"),  # bytes
        ("port", "i8"),
        ("counts_per_si", "f8"),
        ("offset_counts", "f8"),
        ("step", "f8"),  # counts of the converter
        ("low", "f8"),  # counts that the value can have
        ("high", "f8"),
        ("under", "f8"),  # below: under-range, error, and the value is the floor
        ("floor", "f8"),
        ("over", "f8"),  # above: over-range
        ("over_error", "f8"),  # above: error
        ("plain_conversion_ns", "i8"),  # without a filter
        ("conversion_ns", "i8"),
        ("window_cycles", "f8"),  # of the mean that the FIR filter is; 0: none
        ("smoothing", "f8"),  # part of the step that the IIR filter takes in a cycle; 1: none
        ("conversion", "i8"),  # number of the last one
        ("samples", "i8"),
        ("first_counts", "f8"),
        ("filtered", "f8"),
        ("ring", "f8", (FILTER_RING,)),
    ],
    align=True,
)

# 0x8000:15. A notch filter is the mean over a period of its frequency: -3 dB at 0.443 of that
FIR_HZ = (50.0, 60.0)
FIR_60_CONVERSION_S = 521e-6  # with the other one as without
# documented -3 dB at an internal cycle of 1 ms; four channels are filtered every 0.5 ms
IIR_HZ_AT_1_MS = (168.0, 88.0, 43.0, 21.0, 10.5, 5.2, 2.5, 1.2)
IIR_CONVERSION_S = 500e-6


def set_filter(channels: np.ndarray, selection: int, period_s: float) -> None:
    """Gives channels a filter (0x8000:15, or NO_FILTER), settled at the next value.

    Raises ValueError for a selection that there is not.
    """
    if not NO_FILTER <= selection < len(FIR_HZ) + len(IIR_HZ_AT_1_MS):
        raise ValueError(f"found the filter {selection}, expected {NO_FILTER} to 9")
    conversion_ns, window, smoothing = channels["plain_conversion_ns"], 0.0, 1.0
    if 0 <= selection < len(FIR_HZ):
        if selection:
            conversion_ns = round(FIR_60_CONVERSION_S * 1e9)
        window = 1.0 / (FIR_HZ[selection] * period_s)
    elif selection != NO_FILTER:
        conversion_ns = round(IIR_CONVERSION_S * 1e9)
        cut_off_hz = IIR_HZ_AT_1_MS[selection - len(FIR_HZ)] * 1e-3 / IIR_CONVERSION_S
        smoothing = -math.expm1(-2.0 * math.pi * cut_off_hz * period_s)
    channels["conversion_ns"] = conversion_ns
    channels["window_cycles"], channels["smoothing"] = window, smoothing
    channels["samples"] = 0
    channels["ring"] = 0.0


def filter_of(slave: Slave) -> int:
    """The filter that a rig file's ``startup`` of an analog input selects; none where it does not
    switch it on, as the driver then switches it off.
    """
    sampling = slave.description.sampling
    if sampling is None or not sampling.has_filter:
        return NO_FILTER
    startup = {sdo.place: sdo.value for sdo in slave.startup}
    return startup.get(SELECT_OBJECT, 0) if startup.get(ENABLE_OBJECT) else NO_FILTER
