# SPDX-License-Identifier: GPL-3.0-or-later
"""Single values of measured files, read as the databases describe them: nothing of ours is used."""

import math
import struct


def merl_look_up(path, theta_h, theta_d, phi_d):
    """RGB of one bin, as the database's own description has it: nothing of ours is used.

    Three integers with the resolution, then doubles, red before green before blue; theta_h on a
    square-root axis of 90, theta_d of 90 and phi_d of 180 (folded) at whole degrees; the values
    are scaled by 1, 1.15 and 1.66 over 1500.
    """
    th = min(int(math.sqrt(math.degrees(theta_h) * 90)), 89)
    td = min(int(math.degrees(theta_d)), 89)
    pd = min(int(math.degrees(phi_d % math.pi)), 179)
    index = pd + td * 180 + th * 180 * 90
    with path.open("rb") as file:
        assert struct.unpack("<iii", file.read(12)) == (90, 90, 180)
        values = []
        for channel, scale in enumerate((1.0, 1.15, 1.66)):
            file.seek(12 + 8 * (index + channel * 90 * 90 * 180))
            values.append(struct.unpack("<d", file.read(8))[0] * scale / 1500)
        file.seek(0, 2)
        assert file.tell() == 12 + 3 * 8 * 90 * 90 * 180
    return values


def utia_look_up(path, i, j, k, m):
    """RGB at theta_i 15 i, phi_i 7.5 j, theta_o 15 k, phi_o 7.5 m degrees, as dj_brdf.h has it.

    Doubles without a header, red before green before blue, the viewer's azimuth fastest.
    """
    side = 6 * 48
    with path.open("rb") as file:
        values = []
        for channel in range(3):
            file.seek(8 * ((channel * side + i * 48 + j) * side + k * 48 + m))
            values.append(struct.unpack("<d", file.read(8))[0])
    return values
