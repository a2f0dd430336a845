"""Room on the disk that is kept for the end of a file, so that a full disk takes none of it."""

from __future__ import annotations

import ctypes
import errno
import os
import resource

_KEEP_SIZE = 1  # FALLOC_FL_KEEP_SIZE of fallocate(2): blocks behind the end of the file
_REFUSALS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_libc = ctypes.CDLL(None, use_errno=True)
_libc.fallocate.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_int64, ctypes.c_int64)


class DiskReserve:
    """Blocks behind the end of an open file. A file system that has none to give in advance (or a
    device) gives nothing, and takes nothing either.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._reserved_to = 0
        self._is_possible = True

    def hold(self, begin: int, end: int) -> None:
        """Have the bytes from `begin`, the file's size, to `end` ready. Raises OSError where the
        disk, a quota or the process's file size limit does not have them.
        """
        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        if limit != resource.RLIM_INFINITY and end > limit:
            raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))
        if end <= self._reserved_to or not self._is_possible:
            return
        if _libc.fallocate(self._descriptor, _KEEP_SIZE, begin, end - begin):
            number = ctypes.get_errno()
            if number in _REFUSALS:
                raise OSError(number, os.strerror(number))
            self._is_possible = False
        self._reserved_to = end

    def give_back(self, size: int) -> None:
        """Free what lies behind `size`, the file's size."""
        if self._reserved_to > size and self._is_possible:
            os.ftruncate(self._descriptor, size)
        self._reserved_to = size
