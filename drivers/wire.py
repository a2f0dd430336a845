"""Our process image against the slaves' own process data: lengths, cuts, and the working counter
that must come back.
"""

from typing import NamedTuple

from drivers.identity import label
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig
from epa_rt.signals.image import image_of


class Share(NamedTuple):
    """One slave's share of both images: bytes [out_start, out_end) and the length of its inputs."""

    slave: int
    out_start: int
    out_end: int
    in_length: int


class WireImage:
    """Where each slave's bytes stand in our image; ``working_counter`` is 2 per slave with outputs
    plus 1 with inputs.

    Source of the counter: a datagram that reads and writes (LRW) adds 2 for a write and 1 for a
    read, ETG.1000.4.
    """

    def __init__(self, rig: Rig):
        outputs, inputs = image_of(rig, outputs=True), image_of(rig, outputs=False)
        self.labels = tuple(label(i, slave) for i, slave in enumerate(rig.slaves, 1))
        self.output_size, self.input_size = outputs.size, inputs.size
        self.shares = tuple(
            Share(i, *_ends(outputs.slices[s.name]), inputs.slices[s.name][1])
            for i, s in enumerate(rig.slaves)
        )
        self.writers = tuple(share for share in self.shares if share.out_end > share.out_start)
        self.readers = tuple(share.slave for share in self.shares if share.in_length)
        self.working_counter = 2 * len(self.writers) + len(self.readers)

    def check(self, lengths: list[tuple[int, int]], working_counter: int) -> None:
        """``lengths``: bytes of outputs and inputs that the master mapped for each slave, in order.
        Raises BackendError.

        pysoem copies outputs without looking at the length, so that a wrong one would overwrite the
        neighbour.
        """
        for share, (out_length, in_length) in zip(self.shares, lengths, strict=True):
            wanted = share.out_end - share.out_start, share.in_length
            if (out_length, in_length) != wanted:
                raise BackendError(
                    f"found {out_length} bytes of outputs and {in_length} of inputs in the process"
                    f" data of {self.labels[share.slave]}, expected {wanted[0]} and {wanted[1]}"
                    " from the rig file"
                )
        if working_counter != self.working_counter:
            raise BackendError(
                f"found a mapping whose working counter is {working_counter}, expected"
                f" {self.working_counter} from the rig file (2 per slave with outputs, 1 per slave"
                " with inputs)"
            )


def _ends(start_and_length: tuple[int, int]) -> tuple[int, int]:
    start, length = start_and_length
    return start, start + length
