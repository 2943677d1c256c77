"""Say whether this Blender can render measured materials.

blender -b --python-exit-code 1 --python check_worker.py
"""

import sys

import _cycles
import bpy

if not _cycles.with_osl:
    sys.exit(f"Blender {bpy.app.version_string} was built without Open Shading Language")
sys.stdout.write(f"Blender {bpy.app.version_string} renders measured materials\n")
