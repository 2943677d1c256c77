# SPDX-License-Identifier: GPL-3.0-or-later
"""UTIA mosaics as OpenEXR files, written with the library itself."""

import numpy as np


def write_exr(path, f_r, dtype=np.float32, compression="ZIP", names="RGB", **more):
    """Write a table (6, 48, 6, 48, 3) as a picture of 288 x 288; `more` are further channels."""
    import OpenEXR

    pixels = f_r.reshape(288, 288, 3)
    channels = {name: np.ascontiguousarray(pixels[..., c], dtype) for c, name in enumerate(names)}
    kind = getattr(OpenEXR, f"{compression}_COMPRESSION")
    with OpenEXR.File(
        {"type": OpenEXR.scanlineimage, "compression": kind}, channels | more
    ) as file:
        file.write(str(path))
    return path
