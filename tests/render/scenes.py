"""Small scenes for the tests of this folder, rendered with the plain estimator.

Directions are world coordinates; the facets and planes here lie so that their local frame is the
world's, unless said.
"""

import math

import numpy as np


class Stage:
    """Makes scenes out of a few primitives: `blender` is the bpy module, `addon` the fixture."""

    def __init__(self, blender, addon):
        self.data = blender.data
        self.addon = addon

    def scene(self, size, samples, *, seed=0, light=0.0):
        """An empty scene of `size` (width, height) pixels in a uniform environment."""
        scene = self.data.scenes.new("Test")
        scene.world = self.addon("standard_sphere").new_world(None)
        background = scene.world.node_tree.nodes["Background"]
        background.inputs["Strength"].default_value = light
        self.addon("rendering").render_settings(scene, *size, samples, seed)
        return scene

    def add(self, scene, name, data, location=(0, 0, 0)):
        item = self.data.objects.new(name, data)
        item.location = location
        scene.collection.objects.link(item)
        return item

    def mesh(self, scene, material, vertices, faces):
        mesh = self.data.meshes.new("Mesh")
        mesh.from_pydata(np.asarray(vertices).tolist(), [], np.asarray(faces).tolist())
        mesh.materials.append(material)
        return self.add(scene, "Mesh", mesh)

    def plane(self, scene, material, size=2.0):
        """A square around the origin that faces +Z."""
        r = size / 2
        return self.mesh(
            scene, material, [(-r, -r, 0), (r, -r, 0), (r, r, 0), (-r, r, 0)], [(0, 1, 2, 3)]
        )

    def camera(self, scene, width, angle=0.0, distance=2.0):
        """Orthographic view of the origin, `angle` degrees from +Z towards -Y."""
        camera = self.add(scene, "Camera", self.data.cameras.new("Camera"))
        camera.data.type = "ORTHO"
        camera.data.ortho_scale = width
        theta = math.radians(angle)
        camera.location = (0, -distance * math.sin(theta), distance * math.cos(theta))
        camera.rotation_euler = (theta, 0, 0)
        scene.camera = camera
        return camera

    def tilted_plane(self, material, angle, samples, *, size=32):
        """A plane under white light that fills the view from `angle` degrees off its normal."""
        scene = self.scene((size, size), samples, light=1.0)
        self.plane(scene, material)
        self.camera(scene, 0.1, angle)
        return scene

    def facets(self, material, normals, samples, *, seed=0, light=0.0):
        """One facet per pixel, which it fills, seen from +Z; nothing shades anything.

        normals : (height, width, 3) unit, z > 0, in the order of the picture's pixels
        """
        height, width = normals.shape[:2]
        scene = self.scene((width, height), samples, seed=seed, light=light)
        row, column = np.indices((height, width))
        centre = np.stack([column - (width - 1) / 2, (height - 1) / 2 - row, 0 * row], -1)
        corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
        rise = -(normals[..., :2] @ corners.T) / normals[..., 2:]
        corners = np.concatenate(
            [np.broadcast_to(corners, (*rise.shape, 2)), rise[..., None]], axis=-1
        )
        vertices = (centre[..., None, :] + corners).reshape(-1, 3)
        item = self.mesh(scene, material, vertices, np.arange(len(vertices)).reshape(-1, 4))
        item.visible_shadow = item.visible_diffuse = item.visible_glossy = False
        self.camera(scene, max(width, height), distance=100)
        return scene

    def sun(self, scene, direction, irradiance=1.0):
        """A sun without size, towards `direction`."""
        lamp = self.data.lights.new("Sun", "SUN")
        lamp.angle = 0
        lamp.energy = irradiance
        item = self.add(scene, "Sun", lamp)
        item.rotation_euler = rotation_to(direction)
        return item


def rotation_to(direction):
    """Euler angles that turn +Z to a direction: a lamp shines along its own -Z."""
    x, y, z = direction
    return (0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))


def normals_at(theta, phi):
    """Unit normals (..., 3) at polar angles from the viewer of `facets` and azimuths."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def mean_and_noise(pixels):
    """Mean over the pixels (..., 3) of (..., h, w, 3) and its standard error."""
    count = pixels.shape[-3] * pixels.shape[-2]
    return pixels.mean((-3, -2)), pixels.std((-3, -2)) / np.sqrt(count)


def render_seeds(render, scene, seeds):
    """Pictures of a scene that Cycles builds once: mesh and shaders are most of its time."""
    scene.render.use_persistent_data = True
    pictures = []
    for seed in seeds:
        scene.cycles.seed = seed
        pictures.append(render(scene))
    return pictures


def blocks(pixels, size):
    """Means over squares of size x size pixels: (h / size, w / size, 3) of (h, w, 3)."""
    height, width = pixels.shape[0] // size, pixels.shape[1] // size
    return pixels.reshape(height, size, width, size, 3).mean((1, 3))


def check_equal(pictures, references, *, noise, error):
    """Blocks of independent pictures have the mean of independent references.

    pictures, references : sequences of (h, w, 3)
    noise : the largest relative noise with which the test still means something
    error : relative difference that is allowed besides
    """
    pictures, references = np.array(pictures), np.array(references)
    mean, expected = pictures.mean(0), references.mean(0)
    variance = pictures.var(0, ddof=1) / len(pictures)
    variance += references.var(0, ddof=1) / len(references)
    lit = expected > 0
    assert (mean[~lit] == 0).all()
    mean, expected, variance = mean[lit], expected[lit], variance[lit]
    # a few runs tell the noise of one block badly: it is taken as alike in all, relatively
    found = np.sqrt((variance / expected**2).mean())
    assert found < noise, found
    assert (np.abs(mean / expected - 1) < error + 5 * found).all()
    assert abs(mean.mean() / expected.mean() - 1) < error + found
