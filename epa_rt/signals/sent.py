"""Raw images of a whole log -> SI columns: what the rig was told and what it answered, byte by
byte.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of


def sent_columns(rig: Rig, outputs_raw: np.ndarray) -> dict[str, np.ndarray]:
    """The commands of N output images, uint8 (N, bytes): (N,) float64 in SI for every output row,
    in table order.

    A row that counts cannot hold finer comes back on its grid of counts. Raises ValueError where
    the images have not the size that the rig's slaves give.
    """
    return _columns(rig, outputs_raw, outputs=True)


def received_columns(rig: Rig, inputs_raw: np.ndarray) -> dict[str, np.ndarray]:
    """As sent_columns, of the input images and rows; whether a sensor is to be believed is not
    asked here.
    """
    return _columns(rig, inputs_raw, outputs=False)


def _columns(rig: Rig, raw: np.ndarray, outputs: bool) -> dict[str, np.ndarray]:
    image = image_of(rig, outputs)
    if raw.ndim != 2 or raw.shape[1] != image.size:
        raise ValueError(
            f"found {'output' if outputs else 'input'} images of {raw.shape[-1]} bytes, expected"
            f" {image.size}, as the rig's slaves give"
        )
    columns = {}
    for row in rig.outputs if outputs else rig.inputs:
        place = image.places[row.entry]
        if place.entry.code == "?":
            bit = raw[:, place.byte] >> place.bit & 1
            columns[row.name] = (bit ^ row.inverted).astype(np.float64)
            continue
        field = raw[:, place.byte : place.byte + place.entry.bits // 8]
        counts = (
            np.ascontiguousarray(field)
            .view(f"<{_CODES[place.entry.code]}")[:, 0]
            .astype(np.float64)
        )
        if row.name.endswith("_raw"):
            columns[row.name] = counts
        else:
            scaling = scaling_of(row, place.entry, rig)
            columns[row.name] = scaling.slope * counts + scaling.intercept
    return columns


_CODES = {"b": "i1", "B": "u1", "h": "i2", "H": "u2", "i": "i4", "I": "u4"}
