"""A low-pass at every so many-th sample: the sum of taps times samples, in the order of the
taps.
"""

from epa_rt.gap.rig.house.compiled import compiled

BESIDE = 8  # sums at once: one alone waits at every tap for its last addition


@compiled
def decimated(values, taps, every, out):
    """Low-pass of ``values`` (N,) at every ``every``-th sample into ``out``; ends are held."""
    half, last, j = len(taps) // 2, len(values) - 1, 0
    while j < len(out):
        first = j * every - half
        if (
            first >= 0
            and first + (BESIDE - 1) * every + 2 * half <= last
            and j + BESIDE <= len(out)
        ):
            (
                out[j],
                out[j + 1],
                out[j + 2],
                out[j + 3],
                out[j + 4],
                out[j + 5],
                out[j + 6],
                out[j + 7],
            ) = _beside(values[first:], taps, every)
            j += BESIDE
        else:
            out[j] = _held(values, taps, first)
            j += 1


@compiled
def _beside(values, taps, every):
    """BESIDE sums, of windows that begin ``every`` samples apart; each is summed as ``_held`` sums
    it, bit for bit.
    """
    a = b = c = d = e = f = g = h = 0.0
    vb, vc, vd, ve = values[every:], values[2 * every :], values[3 * every :], values[4 * every :]
    vf, vg, vh = values[5 * every :], values[6 * every :], values[7 * every :]
    for i in range(len(taps)):
        tap = taps[i]
        a, b, c, d = a + tap * values[i], b + tap * vb[i], c + tap * vc[i], d + tap * vd[i]
        e, f, g, h = e + tap * ve[i], f + tap * vf[i], g + tap * vg[i], h + tap * vh[i]
    return a, b, c, d, e, f, g, h


@compiled
def _held(values, taps, first):
    """One sum; what lies beyond an end of ``values`` is as that end."""
    last, total = len(values) - 1, 0.0
    for i in range(len(taps)):
        total += taps[i] * values[min(max(first + i, 0), last)]
    return total
