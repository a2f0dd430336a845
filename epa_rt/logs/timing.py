"""Statistics of lateness and busy time over each second of samples."""

from __future__ import annotations

import numpy as np

from epa_rt.logs.layout import FLAG_OVERRUN
from epa_rt.logs.schema import message_class, timing_topic

WINDOW_NS = 1_000_000_000
BUCKET_UPPER_NS = 1000 * 2 ** np.arange(16, dtype=np.int64)
"""Upper edges of the histogram's buckets, 1 us to 33 ms; a last bucket takes what is above."""

_SHARES = {"p50": 0.5, "p99": 0.99, "p999": 0.999, "max": 1.0}


def statistics(
    lateness_ns: np.ndarray, busy_ns: np.ndarray, flags: np.ndarray
) -> dict[str, object]:
    """The fields of a `/timing` message but `cycle`, from int64 and uint32 arrays of one length N
    >= 1.
    """
    fields: dict[str, object] = {
        "samples": len(flags),
        "overruns": int(np.count_nonzero(flags & FLAG_OVERRUN)),
        "bucket_upper_ns": BUCKET_UPPER_NS.tolist(),
    }
    for quantity, values_ns in (("lateness", lateness_ns), ("busy", busy_ns)):
        ordered = np.sort(values_ns)
        for name, share in _SHARES.items():
            rank = max(int(np.ceil(share * len(ordered))), 1)
            fields[f"{quantity}_{name}_ns"] = int(ordered[rank - 1])
        above = np.searchsorted(ordered, BUCKET_UPPER_NS, side="right")
        fields[f"{quantity}_histogram"] = np.diff(above, prepend=0, append=len(ordered)).tolist()
    return fields


class TimingWindows:
    """Cuts the samples into seconds of `t_ns`, counted from the first sample, and encodes one
    message for each.
    """

    def __init__(self) -> None:
        self._message = message_class(timing_topic())
        self._begin_ns: int | None = None
        self._window = 0
        self._pending: list[np.ndarray] = []

    def add(self, slots: np.ndarray) -> list[tuple[int, bytes]]:
        """Take samples (slots, in order); gives `(t_ns, message)` for each window that they
        complete.
        """
        if not len(slots):
            return []
        if self._begin_ns is None:
            self._begin_ns = int(slots["t_ns"][0])
        windows = (slots["t_ns"] - np.uint64(self._begin_ns)) // np.uint64(WINDOW_NS)
        cuts = np.flatnonzero(np.diff(windows, prepend=np.uint64(self._window)))
        done = []
        begin = 0
        for cut in cuts.tolist():
            self._keep(slots[begin:cut])
            done += self.finish()
            begin = cut
        self._window = int(windows[-1])
        self._keep(slots[begin:])
        return done

    def finish(self) -> list[tuple[int, bytes]]:
        """The message of the window still open, if it holds a sample."""
        if not self._pending:
            return []
        rows = np.concatenate(self._pending)
        self._pending = []
        fields = statistics(rows["lateness_ns"], rows["busy_ns"], rows["flags"])
        message = self._message(cycle=int(rows["cycle"][-1]), **fields)
        return [(int(rows["t_ns"][-1]), message.SerializeToString(deterministic=True))]

    def _keep(self, slots: np.ndarray) -> None:
        if len(slots):
            # Copied, for the caller uses its slots again.
            self._pending.append(slots[["cycle", "t_ns", "flags", "lateness_ns", "busy_ns"]].copy())
