"""How much a file may hold once it is unpacked, so that a small file cannot fill the memory."""

LARGEST_UNPACKED = 512 << 20
"""Bytes; seven hours of ten columns at 250 Hz."""


class TooLarge(Exception):
    """The file holds more than any recording of its size; the words follow 'found'."""


def check_unpacked(unpacked: int, size: int, always_taken: int, largest_ratio: float) -> None:
    """Raises TooLarge where a file of ``size`` bytes holds more than it may, in bytes.

    Up to ``always_taken`` everything is; beyond, ``largest_ratio`` times its size.
    """
    if unpacked > LARGEST_UNPACKED:
        raise TooLarge(f"more than {LARGEST_UNPACKED >> 20} MB of variables")
    if unpacked > always_taken and unpacked > largest_ratio * size:
        raise TooLarge(
            f"{size / 1e6:.1f} MB that unpack to over {largest_ratio:.0f} times as much, as no"
            " recording does"
        )
