# SPDX-License-Identifier: GPL-3.0-or-later
"""demo.blend: a scene that shows what measured materials can do.

It is made from nothing but this code and the shipped material library. `forms` makes the meshes,
`stage` the set, its lights and the camera, `materials` says which materials there are and what was
edited, `scene` puts it together and writes the file.
"""
