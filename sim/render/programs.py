"""The shaders as programs, and the vertex layouts that go with them."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

VERSION = "#version 430"


@cache
def source(name: str) -> str:
    """Return the text of one file of ``shaders``."""
    return (resources.files("sim.render") / "shaders" / f"{name}.glsl").read_text()


def program(ctx: Any, vertex: str, fragment: str, *defines: str, shared: tuple[str, ...] = ()) -> Any:
    """Compile a program.

    Args:
        ctx: The context, current.
        vertex: Name of the vertex shader's file.
        fragment: Name of the fragment shader's file.
        defines: Preprocessor names for both.
        shared: Files put before the fragment shader.
    """
    head = "\n".join([VERSION, *(f"#define {name}" for name in defines), ""])
    return ctx.program(
        vertex_shader=head + source(vertex + ".vert"),
        fragment_shader=head + "".join(map(source, shared)) + source(fragment + ".frag"),
    )


def set_uniforms(program: Any, **values: Any) -> None:
    """Set the uniforms that the program uses; the compiler may have dropped some."""
    for name, value in values.items():
        member = program.get(name, None)  # found at once; `in` would go through all of them
        if isinstance(value, bytes) and member is not None:
            member.write(value)
        elif member is not None:
            member.value = value
