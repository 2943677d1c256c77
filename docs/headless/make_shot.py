"""Put a measured material on a ball, save the scene for the farm, and render a picture of it.

blender -b --python-exit-code 1 --python make_shot.py -- MEASURED SHOT.blend PICTURE.exr [SEED]

MEASURED is a measured file, which is fitted here, or a parameter file (.nfm.json).
"""

import math
import sys
from pathlib import Path

import bpy

measured, shot, picture, *rest = sys.argv[sys.argv.index("--") + 1 :]

for item in [*bpy.data.objects]:
    bpy.data.objects.remove(item)
bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
bpy.ops.object.shade_smooth()
# onto the selected objects; raises an error if the file cannot be used
bpy.ops.nfm.import_measurement(filepath=str(Path(measured).resolve()))

scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.shading_system = True  # Open Shading Language
scene.cycles.samples = 32
scene.cycles.seed = int(rest[0]) if rest else 0
scene.render.resolution_x = scene.render.resolution_y = 64
scene.frame_end = 2

lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
lamp.data.energy, lamp.data.size = 200, 1.5
lamp.location, lamp.rotation_euler = (2, -3, 3), (math.radians(50), 0, math.radians(34))
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler = (0, -5, 0), (math.pi / 2, 0, 0)
for item in (lamp, camera):
    scene.collection.objects.link(item)
scene.camera = camera

bpy.ops.wm.save_as_mainfile(filepath=str(Path(shot).resolve()))
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.filepath = str(Path(picture).resolve())
bpy.ops.render.render(write_still=True)
