"""Bytecode in Script nodes."""

import re


def test_bytecode_says_nothing_of_this_machine(addon, fitted):
    node = addon("material").find_script_node(addon("material").build(fitted))
    lines = node.bytecode.split("\n")
    assert lines[0].startswith("OpenShadingLanguage ")
    assert lines[1].startswith("shader nfm_surface")
    assert not re.findall(r"%filename|%line|\.os[lo]\b|/tmp|^#", node.bytecode, re.MULTILINE)
    assert "%argrw" in node.bytecode  # without it nothing could be optimised


def test_equal_sources_have_equal_bytecode(addon, fitted):
    first, second = (
        addon("material").find_script_node(addon("material").build(fitted)) for _ in range(2)
    )
    assert first != second
    assert first.script.as_string() == second.script.as_string()
    assert first.bytecode == second.bytecode
    assert first.bytecode_hash == second.bytecode_hash


def test_strings_of_a_shader_stay(addon):
    strip = addon("script_node").without_origin
    code = 'OpenShadingLanguage 1.00\n# Compiled by\nshader s\nconst\tstring\tc\t"# %line{3}"\n'
    code += 'code ___main___\n# /a/b.osl:3\n\tassign\tx y \t%filename{"/a/\\"}b.osl"} %line{3} '
    code += '%argrw{"wr"}\n\tend\n'
    expected = 'OpenShadingLanguage 1.00\nshader s\nconst\tstring\tc\t"# %line{3}"\n'
    expected += 'code ___main___\n\tassign\tx y \t%argrw{"wr"}\n\tend\n'
    assert strip(code) == expected
