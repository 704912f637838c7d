"""Fair meshes: move vertices along the surface so that threads run straight and even."""
