# SPDX-License-Identifier: GPL-3.0-or-later
"""The Script node and its Text: OSL source in, compiled bytecode in the node.

Blender compiles a Script node by itself only while the scene's engine is Cycles. Here it is
compiled explicitly with Cycles' own functions, so that importing works under any engine; the
bytecode is stored in the node and the .blend renders without the add-on.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import bpy

from .errors import ShaderError

_ORIGIN = re.compile(r'^#.*\n|%filename\{"(?:[^"\\]|\\.)*"\} ?|%line\{\d+\} ?', re.MULTILINE)


def has_osl() -> bool:
    """Whether this Blender was built with Open Shading Language."""
    import _cycles

    return _cycles.with_osl


def require_osl() -> None:
    """For what makes no sense without.

    Raises
    ------
    ShaderError
        This Blender was built without Open Shading Language.
    """
    if not has_osl():
        raise ShaderError(
            "this Blender was built without Open Shading Language and cannot render measured "
            "materials; use a build from blender.org"
        )


def fill(node: bpy.types.ShaderNodeScript, name: str, source: str) -> bool:
    """Put OSL source into the node's Text (made if it has none of its own) and compile it.

    Sockets that the new source still has keep their values and links. If it does not compile, the
    node keeps its bytecode and a Text that it had keeps its source.

    Returns
    -------
    bool
        False in a Blender without OSL: the node then has the source and no bytecode.

    Raises
    ------
    ShaderError
        The source does not compile; the messages of the compiler are on the console.
    """
    text = node.script
    # a copied group still has the same Text, perhaps that of another file
    if text and (text.library or text.users - text.use_fake_user > 1):
        text = None
    previous = text and text.as_string()
    if text is None:
        text = bpy.data.texts.new(name)
        text.use_fake_user = False
    text.from_string(source)
    node.mode = "INTERNAL"
    if node.script != text:
        node.script = text
    if not has_osl():
        node.bytecode = node.bytecode_hash = ""
        _tag(node)
        return False
    try:
        _compile(node)
    except ShaderError:
        if previous is not None:
            text.from_string(previous)
        raise
    return True


def without_origin(bytecode: str) -> str:
    """Bytecode without comments and hints that say where the source was.

    They name temporary files and the folders of this machine, which are nobody's business in a
    .blend, and make the bytecode of one source differ from one compilation to the next.
    """
    # tables are megabytes, and stand before the code
    head, code, rest = bytecode.partition("\ncode ")
    head = "\n".join(line for line in head.split("\n") if not line.startswith("#"))
    return head + _ORIGIN.sub("", code + rest)


def _tag(node: bpy.types.ShaderNodeScript) -> None:
    """Have a render under way notice, and undo, which else keeps the Text of another shader."""
    node.id_data.update_tag()
    node.script.update_tag()


def _compile(node: bpy.types.ShaderNodeScript) -> None:
    import oslquery
    from cycles import osl

    messages: list[str] = []
    try:
        ok, compiled, bytecode, _hash = osl.update_internal_script(
            lambda _level, message: messages.append(message), node.script
        )
    except OSError as error:
        raise ShaderError(
            f"Cycles could not compile the shader of {node.script.name!r}: Blender's folder of "
            f"temporary files cannot be written to ({error.strerror}); free some space there, or "
            "choose another in the preferences"
        ) from error
    try:
        query = oslquery.OSLQuery(compiled) if ok else None
        if not query or not bytecode:
            details = "".join(f": {message}" for message in messages)
            raise ShaderError(
                f"Cycles could not compile the shader of {node.script.name!r}{details}; "
                "see the console, and report it"
            )
        node.bytecode = without_origin(bytecode)
        node.bytecode_hash = hashlib.md5(
            node.bytecode.encode(), usedforsecurity=False
        ).hexdigest()  # as Cycles does: the name under which it keeps a shader
        _tag(node)
        wanted = {osl.shader_param_ensure(node, parameter) for parameter in query.parameters}
    finally:
        # Cycles leaves it behind for internal scripts
        Path(compiled).unlink(missing_ok=True)
    for sockets in (node.inputs, node.outputs):
        for socket in [s for s in sockets if s not in wanted]:
            sockets.remove(socket)
