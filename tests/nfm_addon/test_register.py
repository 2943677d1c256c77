"""Registering leaves nothing behind, and the pure packages stay pure."""

import ast
import json

import pytest

from runner.environment import CHECKOUT

PURE = ("fitter", "osl")

CYCLE = """
import json
sys.path.insert(0, sys.argv[1])
from runner.blender import load_extension
name = load_extension().__name__
import addon_utils

handlers = [n for n in dir(bpy.app.handlers) if isinstance(getattr(bpy.app.handlers, n), list)]

def state():
    return {
        "types": sorted(
            cls.__name__
            for base in (bpy.types.Operator, bpy.types.PropertyGroup, bpy.types.Panel,
                         bpy.types.Menu, bpy.types.AddonPreferences, bpy.types.FileHandler)
            for cls in base.__subclasses__()
            if cls.__module__.startswith(name) and cls.is_registered
        ),
        "operators": sorted(n for n in dir(bpy.ops.nfm)),
        "property": "nfm" in bpy.types.Material.bl_rna.properties,
        "menu": [
            f.__module__ for f in bpy.types.TOPBAR_MT_file_import.draw._draw_funcs
            if f.__module__.startswith(name)
        ],
        "handlers": {n: len(getattr(bpy.app.handlers, n)) for n in handlers},
        "draw functions": sum(
            len(cls.draw._draw_funcs)
            for base in (bpy.types.Menu, bpy.types.Panel, bpy.types.Header)
            for cls in base.__subclasses__()
            if hasattr(getattr(cls, "draw", None), "_draw_funcs")
        ),
        "path": list(sys.path),
    }

states = [state()]
for _ in range(2):
    command = sys.modules[name + ".nfm_addon.command"]
    addon_utils.disable(name)
    states.append(state())
    try:
        bpy.utils.unregister_cli_command(command._handle)
        states[-1]["command"] = True
    except ValueError:
        states[-1]["command"] = False
    addon_utils.enable(name)
    states.append(state())
material = bpy.data.materials.new("test")
material.nfm.sampling = "COSINE"
print(json.dumps(states))
"""


def test_twice_registered_and_unregistered(run_python):
    output = run_python(CYCLE, CHECKOUT)
    # one line: neither Blender nor Python complained
    (line,) = output.splitlines()
    on, off, on_again, off_again, on_at_last = json.loads(line)
    assert on == on_again == on_at_last
    assert off == off_again
    operators = [
        "align_brushing",
        "apply_edits",
        "blend_with",
        "cancel_fit",
        "copy_curve",
        "copy_lobe",
        "export_measurement",
        "export_parameters",
        "give_lamps_size",
        "import_folder",
        "import_measurement",
        "install_library",
        "keep_energy",
        "load_edits",
        "make_editable",
        "paste_curve",
        "paste_lobe",
        "refit",
        "remove_library",
        "replace_measurement",
        "reset_edits",
        "reset_material",
        "save_edits",
        "set_up_render",
        "watch_fits",
    ]
    assert on["operators"] == operators
    assert on["types"] == sorted(
        [
            *(f"NFM_OT_{name}" for name in operators),
            "NFM_AP_preferences",
            "NFM_FH_measured_brdf",
            "NFM_PG_edit",
            "NFM_PG_group",
            "NFM_PG_lobe_sliders",
            "NFM_PG_material",
            "NFM_PG_plot",
            "NFM_PT_edit",
            "NFM_PT_edit_nodes",
            "NFM_PT_material",
            "NFM_PT_material_nodes",
        ]
    )
    assert on["property"] is True
    assert len(on["menu"]) == 2
    assert (off["types"], off["operators"], off["property"], off["menu"]) == ([], [], False, [])
    assert off["command"] is False
    # of the queue, the landings, the search for base lobes, completion of what is opened or
    # appended, and live editing
    added = {name: n - off["handlers"][name] for name, n in on["handlers"].items()}
    assert {name: n for name, n in added.items() if n} == {
        "blend_import_post": 1,
        "depsgraph_update_post": 1,
        "frame_change_post": 1,
        "save_pre": 1,
        "load_post": 2,
        "load_pre": 3,
        "redo_post": 2,
        "render_cancel": 1,
        "render_complete": 1,
        "render_init": 1,
        "undo_post": 2,
    }
    assert off["path"] == on["path"]
    assert off["draw functions"] == on["draw functions"] - 4  # import, assets, status bar


def test_root_imports_no_blender(run_python):
    code = (
        "sys.modules['bpy'] = None\n"
        "import importlib.util\n"
        "spec = importlib.util.spec_from_file_location('root', sys.argv[1])\n"
        "module = importlib.util.module_from_spec(spec)\n"
        "spec.loader.exec_module(module)\n"
        "print(callable(module.register), callable(module.unregister))"
    )
    assert run_python(code, CHECKOUT / "__init__.py", blender=False) == "True True\n"


@pytest.mark.parametrize("package", PURE)
def test_pure_package_imports_no_blender(package, run_python):
    """All its modules, where an import of bpy, of the other package or the add-on is refused."""
    code = (
        "package, other = sys.argv[2:]\n"
        "class Refuse:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('bpy', '_cycles', 'mathutils', 'nfm_addon', other):\n"
        "            raise AssertionError(name)\n"
        "sys.meta_path.insert(0, Refuse())\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "import importlib, pkgutil\n"
        "before = list(sys.path)\n"
        "folder = f'{sys.argv[1]}/{package}'\n"
        "names = [m.name for m in pkgutil.walk_packages([folder], f'{package}.')]\n"
        "for name in names:\n"
        "    name.endswith('__main__') or importlib.import_module(name)\n"
        "assert sys.path == before\n"
        "print(len(names))"
    )
    other = PURE[1 - PURE.index(package)]
    count = int(run_python(code, CHECKOUT, package, other, blender=False))
    # all but the __init__.py of the package itself
    assert count == len(list((CHECKOUT / package).rglob("*.py"))) - 1


def imported_names(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


SOURCES = [
    path
    for folder in (*PURE, "nfm_addon")
    for path in sorted((CHECKOUT / folder).rglob("*.py"))
    if "__pycache__" not in path.parts
]


# What opens connections, in the standard library and in what Blender brings.
NETWORK = {"asyncio", "ftplib", "http", "requests", "smtplib", "socket", "socketserver", "ssl"}
NETWORK |= {"telnetlib", "urllib", "urllib3", "xmlrpc"}


def test_nothing_opens_connections():
    """The manifest asks for no permission to."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES)
    names = {name.split(".")[0] for tree in trees for name in imported_names(tree)}
    assert "numpy" in names
    assert not names & NETWORK


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(CHECKOUT)))
def test_imports_point_one_way(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = list(imported_names(tree))
    if path.relative_to(CHECKOUT).parts[0] in PURE:
        inside = len(path.relative_to(CHECKOUT).parts) - 1  # dots that stay within the package
        outside = "." * (inside + 1)
        wrong = [name for name in names if name.startswith(("bpy", "_cycles", outside))]
    else:
        wrong = [name for name in names if name.split(".")[0] in (*PURE, "nfm_addon", "runner")]
    assert wrong == []
    edits = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and node.attr == "path"
        and isinstance(node.value, ast.Name)
        and node.value.id == "sys"
    ]
    assert edits == []
