"""The file that HDF5 writes to: one that never fails before its eyes.

Where the disk is full, HDF5 cannot close its file, and the process ends in a segmentation fault. So
it writes through this, which notes what went wrong, takes the rest for written, and raises at the
end. Nothing but the dataset itself is held in memory.
"""

from __future__ import annotations

import io
from typing import Any


class Sink(io.FileIO):
    """A new file, open for reading and writing.

    Attributes
    ----------
    failure : BaseException or None
        What ended the writing: a full disk, or an interruption that came meanwhile.
    """

    failure: BaseException | None = None

    def write(self, data: Any, /) -> int:
        """Write all of it, or note why not."""
        left = memoryview(data).cast("B")
        size, end = len(left), self.tell() + len(left)
        try:
            while len(left) and self.failure is None:
                left = left[super().write(left) :]
        except BaseException as failure:
            self.failure = failure
        self.seek(end)
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Set the size, or note why not."""
        try:
            if self.failure is None:
                return super().truncate(size)
        except BaseException as failure:
            self.failure = failure
        return self.tell() if size is None else size

    def readinto(self, buffer: Any, /) -> int:
        """Read; zeros, where what is to be read could not be written."""
        room = memoryview(buffer).cast("B")
        found = 0
        if self.failure is None:
            try:
                found = super().readinto(room) or 0
            except BaseException as failure:
                self.failure = failure
        if self.failure is not None:
            room[found:] = bytes(len(room) - found)
            return len(room)
        return found
