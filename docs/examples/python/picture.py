"""Top views as PNG files, with the standard library and NumPy alone."""
import struct
import zlib

import numpy as np


class TopView:
    """A picture of a part of the ground, seen from above."""

    def __init__(self, positions, pixel_m=0.2, margin_m=5.0):
        """Covers `positions`, (N, 2) or (N, 3), metres, but for the farthest per cent."""
        low, high = np.percentile(np.asarray(positions)[:, :2], (1, 99), axis=0)
        self.low, self.pixel_m = low - margin_m, pixel_m
        width, height = np.ceil((high - low + 2 * margin_m) / pixel_m).astype(int)
        self.pixels = np.full((height, width, 3), 255, np.uint8)

    def draw(self, positions, color, size=1):
        """Draws positions as squares of `size` pixels."""
        at = np.floor((np.asarray(positions)[:, :2] - self.low) / self.pixel_m).astype(int)
        for shift in np.ndindex(size, size):
            column, row = (at + shift).T
            inside = (column >= 0) & (row >= 0) & (column < self.pixels.shape[1]) \
                & (row < self.pixels.shape[0])
            self.pixels[-1 - row[inside], column[inside]] = color

    def write(self, path):
        """Writes a PNG file."""
        height, width, _ = self.pixels.shape
        rows = b"".join(b"\0" + row.tobytes() for row in self.pixels)
        with open(path, "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
            for kind, data in ((b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)),
                               (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b"")):
                file.write(struct.pack(">I", len(data)) + kind + data
                           + struct.pack(">I", zlib.crc32(kind + data)))
