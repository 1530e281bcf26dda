"""Links between shader nodes."""

from __future__ import annotations

import bpy


def linked_node(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """Returns the node that an input is linked to, past reroutes; None without one."""
    seen = 0
    while socket.is_linked and seen < 100:
        node = socket.links[0].from_node
        if node.bl_idname != "NodeReroute":
            return node
        socket, seen = node.inputs[0], seen + 1
    return None
