"""The channels of input terminals, compiled: input filter, conversion, limits, status and toggle.

What a terminal's are: epa_rt/config/terminals/; the filter's constants: input_filter.py.
"""

import math

import numpy as np

from sim_backend.bytes_of_image import put_counts, put_word
from sim_backend.compiled import compiled
from sim_backend.input_filter import FILTER_RING


@compiled
def sample_channels(inputs, analog, ports, t_ns: int) -> None:
    """Turns the plant's sensors into the channels' values and status words at time t_ns."""
    for i in range(analog.shape[0]):
        channel = analog[i]
        counts = 0.0
        if channel.port >= 0:
            counts = ports[channel.port] * channel.counts_per_si + channel.offset_counts
        counts = _filtered(channel, counts)
        conversion = t_ns // channel.conversion_ns
        if conversion != channel.conversion or channel.samples == 1:
            channel.conversion = conversion
            _convert(inputs, channel, counts, conversion & 1)


@compiled
def _convert(inputs, channel, counts: float, toggle: int) -> None:
    counts = math.floor(counts / channel.step + 0.5) * channel.step
    status = toggle << 15
    if counts > channel.over_error:
        status |= 0x42
    elif counts > channel.over:
        status |= 0x02
    elif counts < channel.under:
        status |= 0x41
        counts = channel.floor
    counts = min(max(counts, channel.low), channel.high)
    put_counts(inputs, channel.value_byte, channel.value_size, counts)
    put_word(inputs, channel.status_byte, status)


@compiled
def _filtered(channel, counts: float) -> float:
    """The value behind the channel's filter, whose state moves on by a period."""
    first = channel.samples == 0
    channel.samples += 1
    if channel.window_cycles > 0.0:
        return _mean(channel, counts, first)
    if channel.smoothing < 1.0:
        before = counts if first else channel.filtered
        channel.filtered = before + channel.smoothing * (counts - before)
        return channel.filtered
    return counts


@compiled
def _mean(channel, counts: float, first: bool) -> float:
    """Mean over the window: what has been added up since its start, over its length."""
    if first:
        channel.first_counts, channel.filtered = counts, 0.0
    channel.filtered += counts - channel.first_counts
    head = channel.samples
    channel.ring[head % FILTER_RING] = channel.filtered
    whole = np.int64(channel.window_cycles)
    part = channel.window_cycles - whole
    start = (1.0 - part) * channel.ring[(head - whole) % FILTER_RING]
    start += part * channel.ring[(head - whole - 1) % FILTER_RING]
    return channel.first_counts + (channel.filtered - start) / channel.window_cycles
