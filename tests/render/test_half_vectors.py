"""Half vectors that the shader draws are distributed by its own density, and by the fitter's.

The shader emits what it draws at each pixel, with the tables and the code that it renders with.
"""

import numpy as np
import pytest

from fitter.models.anisotropic_tables import anisotropic_sampling, anisotropic_selection
from fitter.models.tables import sampling_tables, selection_table, versine_nodes
from tests.models import ANISOTROPIC_MODELS, MODELS

ALL_MODELS = MODELS | ANISOTROPIC_MODELS
COUNT = 60_000
VIEW = np.array([0.48, 0.36, 0.8])
STATEMENTS = """
  if (cos_o > 0.0) {
    float shares[N_LOBES];
    selection_probabilities(elevation_o, phi_o, tints, selection_table, shares);
    color random = uniform_numbers(0);
    float v, phi, pdf;
    sample_half_vector(random[0], random[1], shares, DENSITY_TABLES, v, phi, pdf);
    float again = half_vector_density(v, phi, shares, DENSITY_TABLES);
    Value = color(v, phi, abs(again - pdf) < 1e-3 * pdf ? pdf : -1.0);
  }

  closure color sum = 0;
"""


@pytest.fixture
def draw(addon, monkeypatch):
    """What the shader of a model draws: v = 1 - cos theta_h, phi_h and the density (n,) each."""
    module = addon("evaluate")
    new_surface = addon("shader_source").new_surface

    def shader(model, _sampling):
        source = new_surface(model, "reference").source
        before = "\n  closure color sum = 0;\n"
        assert source.count(before) == 1
        return addon("shader_source").Surface(source.replace(before, STATEMENTS), None)

    monkeypatch.setattr(module, "new_surface", shader)

    def run(model, count):
        views = np.broadcast_to(VIEW, (count, 3))
        return module.evaluate_through_osl(model, views, views).T

    return run


def shares(model):
    """Probability of each lobe towards VIEW: its albedo, and a hundredth of the sum."""
    theta, phi = np.arccos(VIEW[2]), np.arctan2(VIEW[1], VIEW[0])
    if model.kind == "anisotropic":
        table = anisotropic_selection(model).sum(-1)
        row, column = theta / (np.pi / 2) * 15, phi / (2 * np.pi) * 24
        rows = (1 - row % 1) * table[:, int(row)] + row % 1 * table[:, int(row) + 1]
        left, s = int(column), column % 1
        albedo = (1 - s) * rows[:, left] + s * rows[:, (left + 1) % 24]
    else:
        table = selection_table(model).sum(-1)
        row = theta / (np.pi / 2) * 30
        albedo = (1 - row % 1) * table[:, int(row)] + row % 1 * table[:, int(row) + 1]
    return (albedo + 0.01 * albedo.sum()) / (1.03 * albedo.sum())


def density(model, v, phi):
    """Density (n,) of the mixture in v and phi, from the tables."""
    if model.kind == "anisotropic":
        tables = anisotropic_sampling(model)
        column = phi / (2 * np.pi) * 48
        left, s = column.astype(int) % 48, column % 1
        rows = np.tensordot(shares(model), tables.row_density, 1)
        nodes = tables.nodes
        upper = np.clip(np.searchsorted(nodes, v, side="right") - 1, 0, len(nodes) - 2)
        t = (v - nodes[upper]) / (nodes[upper + 1] - nodes[upper])
        at = [rows[r, left] * (1 - s) + rows[r, (left + 1) % 48] * s for r in (upper, upper + 1)]
        return at[0] * (1 - t) + at[1] * t
    mixture = shares(model) @ sampling_tables(model).density
    return np.interp(v, versine_nodes(), mixture)


def cells(model):
    """Edges in v at equal shares of the density, and in phi, away from the nodes of the tables."""
    v = np.concatenate([[0], np.geomspace(1e-7, 1, 4000)])
    phi = (np.arange(96) + 0.5) / 96 * 2 * np.pi
    middle = (v[1:] + v[:-1]) / 2
    whole = density(model, *(a.ravel() for a in np.meshgrid(middle, phi, indexing="ij")))
    profile = np.cumsum(whole.reshape(len(middle), -1).mean(1) * np.diff(v))
    edges = np.interp(np.linspace(0, profile[-1], 13), np.append(0, profile), v)
    return np.append(edges[:-1], 1.0), np.linspace(0, 2 * np.pi, 18)


def expected_shares(model, v_edges, phi_edges):
    """Integral (rows, columns) of the density over the cells."""
    t, u = (np.arange(60) + 0.5) / 60, (np.arange(40) + 0.5) / 40
    v = (v_edges[:-1, None] + np.diff(v_edges)[:, None] * t).ravel()
    phi = (phi_edges[:-1, None] + np.diff(phi_edges)[:, None] * u).ravel()
    values = density(model, *(a.ravel() for a in np.meshgrid(v, phi, indexing="ij")))
    means = values.reshape(len(v_edges) - 1, 60, len(phi_edges) - 1, 40).mean((1, 3))
    return means * np.outer(np.diff(v_edges), np.diff(phi_edges))


@pytest.mark.parametrize("name", ALL_MODELS)
def test_chi_square_of_half_vectors(name, draw):
    model = ALL_MODELS[name]
    v, phi, pdf = draw(model, COUNT)
    assert (pdf > 0).all()  # -1 where the density, asked for again, is another
    np.testing.assert_allclose(pdf, density(model, v, phi), rtol=2e-3)
    edges = cells(model)
    expected = expected_shares(model, *edges)
    assert expected.sum() == pytest.approx(1, abs=2e-3)
    found, _, _ = np.histogram2d(v, phi, edges)
    assert found.sum() == COUNT
    chi_square = ((found - COUNT * expected) ** 2 / (COUNT * expected)).sum()
    freedom = expected.size - 1
    assert (COUNT * expected).min() > 20
    # four standard deviations: one test in 30,000 fails by chance
    assert chi_square < freedom + 4 * np.sqrt(2 * freedom)
    # such a test would notice the density of another material
    other = ALL_MODELS["velvet" if name != "velvet" else "matte"]
    wrong = expected_shares(other, *edges)
    assert ((found - COUNT * wrong) ** 2 / (COUNT * wrong)).sum() > 5 * freedom
