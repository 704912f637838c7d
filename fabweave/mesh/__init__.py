"""Hold polygon meshes: read, check, repair, write; half-edges; built-in shapes."""
