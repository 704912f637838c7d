"""Make pictures of meshes, ribbons and models, without GPU or display."""
