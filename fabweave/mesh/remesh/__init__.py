"""Turn meshes of triangles into meshes of quads."""
