"""Cycles evaluates and samples the closures as fitter/shading/closures.py does.

Nothing documents the ramps, their signs or that Cycles picks a closure by its weight alone; these
tests hold it on every supported version.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fitter.shading.closures import Closure

KINDS = (
    Closure("ggx", 0.002),
    Closure("ggx", 0.01),
    Closure("ggx", 0.1),
    Closure("ggx", 0.6),
    Closure("beckmann", 0.002),
    Closure("beckmann", 0.05),
    Closure("beckmann", 0.5),
    Closure("diffuse_ramp"),
    Closure("phong_ramp", 1.0),
    Closure("phong_ramp", 30.0),
    Closure("phong_ramp", 2000.0),
    Closure("phong_ramp", 50000.0),
    Closure("phong_ramp", 0.0, lean=0.5),
    Closure("phong_ramp", 10.0, lean=0.5),
    Closure("phong_ramp", 300.0, lean=0.5),
    Closure("phong_ramp", 50.0, lean=1.0),
    Closure("phong_ramp", 20.0, lean=-0.3),
    Closure("phong_ramp", 2000.0, lean=-0.3),
    Closure("phong_ramp", 50.0, lean=-0.6),
    Closure("ggx", 0.1, across=0.4),
    Closure("ggx", 0.5, across=0.08, azimuth=0.7),
    Closure("beckmann", 0.12, across=0.4, azimuth=-2.1),
    Closure("phong_ramp", 40.0, tilt=0.35, azimuth=2.4),
    Closure("phong_ramp", 3.0, tilt=0.6, azimuth=-0.3),
)


@dataclass(frozen=True)
class Term:
    """A closure with its colours (n_columns, 3), given to Cycles with `pick` as its weight."""

    closure: Closure
    colours: np.ndarray
    pick: float = 1.0

    def value(self, wi, wo):
        """f cos(theta_i) (n, 3)."""
        return self.closure.columns(wi, wo).T @ self.colours

    def magnitude(self, wi, wo):
        """What value would be if no colours cancelled (n, 3)."""
        return self.closure.columns(wi, wo).T @ np.abs(self.colours)

    @property
    def has_direction(self):
        """Whether there is more to it than the surface's normal."""
        return bool(self.closure.lean or self.closure.tilt or self.closure.across)

    def direction(self, theta_o):
        """The closure's own normal (n, 3) at view angles (n,), or its tangent."""
        closure = self.closure
        if closure.across:
            return np.tile([np.cos(closure.azimuth), np.sin(closure.azimuth), 0], (len(theta_o), 1))
        return np.array(
            [closure.normal(np.array([np.sin(theta), 0, np.cos(theta)])) for theta in theta_o]
        )

    def source(self, index):
        """OSL statements that add the closure to `sum`; its own direction is Axis<index>."""
        colours = [f"color({r:.9g}, {g:.9g}, {b:.9g})" for r, g, b in self.colours / self.pick]
        parameter = f"{self.closure.parameter:.9g}"
        axis = f"normalize(Axis{index})" if self.has_direction else "N"
        if self.closure.kind == "phong_ramp":
            name = f"phong_ramp({axis}, {parameter}, colours{index})"
        elif self.closure.kind == "diffuse_ramp":
            name = f"diffuse_ramp({axis}, colours{index})"
        else:
            name = (
                f"generalized_schlick_bsdf(N, {axis}, color(1), color(0), {parameter}, "
                f"{self.closure.alphas[1]:.9g}, colours{index}[0], colours{index}[1], 5.0, "
                f'"{self.closure.kind}")'
            )
        return (
            f"  color colours{index}[{len(colours)}] = {{{', '.join(colours)}}};\n"
            f"  sum = {self.pick:.9g} * {name} + sum;\n"
        )


def total(terms, wi, wo):
    return sum(term.value(wi, wo) for term in terms), sum(term.magnitude(wi, wo) for term in terms)


def signed_colours(rng, closure):
    """Random colours; those of a ramp change sign along it and differ between the channels."""
    colours = rng.uniform(0.1, 0.9, (closure.n_columns, 3))
    if closure.signed:
        colours *= rng.choice([-1, 1, 1], colours.shape)
        colours[-1] = [0.9, -0.8, 0.7]  # at the lobe's peak, where most of its energy is
    return colours


def local_directions(theta_o, wo_to_wi, phi):
    """wi (n, 3) at an angle of wo_to_wi from wo (3,), and around it at azimuths phi (n,)."""
    wo = np.array([np.sin(theta_o), 0, np.cos(theta_o)])
    across = np.array([-np.cos(theta_o), 0, np.sin(theta_o)])
    around = np.cos(phi)[:, None] * across + np.sin(phi)[:, None] * np.array([0, 1.0, 0])
    return np.cos(wo_to_wi) * wo + np.sin(wo_to_wi) * around, wo


def local_frames(theta_o, phi):
    """Axes (h, w, 3, 3), in the world, of the frames in which local_directions counts.

    The viewer is at +Z of the world, wi in its x-z plane. theta_o (h,), phi (h, w)
    """
    sin_o, cos_o = np.sin(theta_o)[:, None, None], np.cos(theta_o)[:, None, None]
    across = np.stack([np.cos(phi), -np.sin(phi), 0 * phi], -1)
    y = np.stack([np.sin(phi), np.cos(phi), 0 * phi], -1)
    up = np.array([0, 0, 1.0])
    return np.stack([sin_o * up - cos_o * across, y, cos_o * up + sin_o * across], -2)


@pytest.fixture
def closure_facets(stage, script_material):
    """Scene of facets with a sum of closures, leaning as they should at the view angles."""

    def build(terms, theta_o, phi, **settings):
        frames = local_frames(theta_o, phi)
        leaning = {i: term for i, term in enumerate(terms) if term.has_direction}
        sockets = "".join(f"    vector Axis{i} = vector(0),\n" for i in leaning)
        body = "".join(term.source(i) for i, term in enumerate(terms))
        material = script_material(
            f"shader sum_of_closures(\n{sockets}    output closure color BSDF = 0)\n"
            f"{{\n  closure color sum = 0;\n{body}  BSDF = sum;\n}}\n",
            attributes={f"Axis{i}": f"axis{i}" for i in leaning},
        )
        scene = stage.facets(material, frames[..., 2, :], **settings)
        mesh = next(item.data for item in scene.objects if item.type == "MESH")
        for i, term in leaning.items():
            axis = np.einsum("hi,hwij->hwj", term.direction(theta_o), frames)
            attribute = mesh.attributes.new(f"axis{i}", "FLOAT_VECTOR", "FACE")
            attribute.data.foreach_set("vector", axis.astype(np.float32).ravel())
        return scene

    return build


def choose_directions(terms, wo_to_wi, rng):
    """View angles (16,) and azimuths (16, 16): half of each where the closures are bright."""
    views, phi = np.radians(np.linspace(1, 86, 60)), np.linspace(0, 2 * np.pi, 180)
    values = np.array(
        [total(terms, *local_directions(view, wo_to_wi, phi))[1].sum(1) for view in views]
    )
    bright = values > 0.05 * values.max()
    rows = np.concatenate([rng.choice(np.flatnonzero(bright.any(1)), 8), rng.choice(60, 8)])
    columns = rng.choice(180, (16, 16))
    for i, row in enumerate(rows):
        if bright[row].any():
            columns[i, :8] = rng.choice(np.flatnonzero(bright[row]), 8)
    return views[rows], phi[columns]


def rounding(closure):
    """Relative error that single precision leaves Cycles at the peak, where a cosine is near 1."""
    eps = np.finfo(np.float32).eps
    if closure.kind == "diffuse_ramp":
        return 0
    return 20 * eps * closure.parameter if closure.signed else 4 * eps / closure.parameter**2


def check_evaluation(terms, view, stage, closure_facets, render):
    """A sun makes Cycles evaluate f cos_i at one light direction per facet."""
    rng = np.random.default_rng(view)
    theta, first = np.radians(view), terms[0].closure
    # close to the distance at which the first lobe's peak is seen under the view angle
    towards_wo = first.leaning(theta) + first.tilt * np.cos(first.azimuth)
    wo_to_wi = 2 * (theta - towards_wo) + np.radians(2)
    theta_o, phi = choose_directions(terms, wo_to_wi, rng)
    scene = closure_facets(terms, theta_o, phi, samples=1)
    stage.sun(scene, (np.sin(wo_to_wi), 0, np.cos(wo_to_wi)))
    found = render(scene)
    rows = [
        total(terms, *local_directions(angle, wo_to_wi, azimuths))
        for angle, azimuths in zip(theta_o, phi, strict=True)
    ]
    expected, magnitude = np.moveaxis(rows, 1, 0)
    error = np.abs(found - expected) / (magnitude + 1e-3 * magnitude.max())
    assert error.max() < 2e-4 + max(rounding(term.closure) for term in terms)


@pytest.mark.parametrize("closure", KINDS, ids=str)
def test_evaluates(closure, stage, closure_facets, render):
    colours = signed_colours(np.random.default_rng(0), closure)
    # what is evaluated must not depend on how often it is picked; Cycles cuts F0 off at 1
    term = Term(closure, colours, pick=0.125 if closure.signed else 1.0)
    for view in (25, 78):
        check_evaluation([term], view, stage, closure_facets, render)


def mixtures():
    """Sums of closures, by name."""
    rng = np.random.default_rng(1)
    lobe = Closure("ggx", 0.2)
    ramp = Closure("phong_ramp", 60.0)
    taken_away = -rng.uniform(0.01, 0.05, (8, 3))
    kinds = [Closure("diffuse_ramp"), Closure("phong_ramp", 12.0, -0.3), Closure("beckmann", 0.4)]
    return {
        "lobe minus a part of it": [
            Term(lobe, np.array([[0.5, 0.6, 0.7], [1, 1, 1]])),
            Term(ramp, taken_away, pick=0.04),
        ],
        "the same, hardly ever picked": [
            Term(lobe, np.array([[0.5, 0.6, 0.7], [1, 1, 1]])),
            Term(ramp, taken_away, pick=0.004),
        ],
        "four kinds": [
            Term(lobe, np.array([[0.1, 0.2, 0.3], [0.5, 0.4, 0.3]])),
            *[
                Term(kind, 0.3 * signed_colours(rng, kind), 0.3 if kind.signed else 1)
                for kind in kinds
            ],
        ],
    }


MIXTURES = mixtures()


@pytest.mark.parametrize("name", MIXTURES)
def test_evaluates_a_sum(name, stage, closure_facets, render):
    check_evaluation(MIXTURES[name], 50, stage, closure_facets, render)


def albedo(terms, theta_o):
    """Integrals (3,) of value and magnitude over the light directions.

    Midpoints around the mirror direction of the first term, dense there; half of them where both
    sides of the plane of incidence are alike.
    """
    closure = terms[0].closure
    alike = all(term.closure.turns_with_the_view for term in terms)
    turn, n_phi = (np.pi, 60) if alike else (2 * np.pi, 300)
    n_t = 1200
    t = (np.arange(n_t) + 0.5) / n_t
    angle, phi = np.meshgrid(np.pi * t**3, turn * (np.arange(n_phi) + 0.5) / n_phi)
    solid_angle = np.sin(angle) * 3 * np.pi * t**2 / n_t * 2 * np.pi / n_phi
    x, y, z = np.sin(angle) * np.cos(phi), np.sin(angle) * np.sin(phi), np.cos(angle)
    axis = 0 if closure.kind == "diffuse_ramp" else 2 * closure.leaning(theta_o) - theta_o
    cos_axis, sin_axis = np.cos(axis), np.sin(axis)
    wi = np.stack([x * cos_axis + z * sin_axis, y, z * cos_axis - x * sin_axis], -1).reshape(-1, 3)
    above = wi[:, 2] > 0
    wo = np.array([np.sin(theta_o), 0, np.cos(theta_o)])
    return [solid_angle.ravel()[above] @ values for values in total(terms, wi[above], wo)]


FURNACE_VIEWS = np.radians([5, 40, 60, 80])


def check_furnace(terms, closure_facets, render):
    """Uniform light: Cycles samples the closures, and weighs the samples by evaluating them."""
    expected, magnitude = np.moveaxis([albedo(terms, view) for view in FURNACE_VIEWS], 1, 0)
    theta_o = np.repeat(FURNACE_VIEWS, 4)
    scene = closure_facets(terms, theta_o, np.zeros((16, 64)), samples=128, light=1.0)
    pixels = render(scene).reshape(4, 256, 3)
    noise = pixels.std(1) / 16
    assert (noise < 5e-3 * magnitude).all()
    # Cycles draws half vectors of a Beckmann lobe with an approximate inverse
    bias = 3e-3 if any(term.closure.kind == "beckmann" for term in terms) else 3e-4
    assert (np.abs(pixels.mean(1) - expected) < bias * magnitude.max(0) + 4 * noise).all()


def drawable(term):
    """The term without what has no finite variance: a diffuse ramp that is not 0 at the horizon.

    Cycles draws its directions in proportion to cos(theta_i), which vanishes there.
    """
    colours = term.colours.copy()
    if term.closure.kind == "diffuse_ramp":
        colours[0] = 0
    return replace(term, colours=colours)


@pytest.mark.parametrize("closure", KINDS, ids=str)
def test_furnace_shows_the_albedo(closure, closure_facets, render):
    colours = signed_colours(np.random.default_rng(0), closure)
    term = Term(closure, colours, pick=0.125 if closure.signed else 1.0)
    check_furnace([drawable(term)], closure_facets, render)


@pytest.mark.parametrize("name", MIXTURES)
def test_furnace_shows_the_albedo_of_a_sum(name, closure_facets, render):
    check_furnace([drawable(term) for term in MIXTURES[name]], closure_facets, render)
