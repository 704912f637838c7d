"""Turn ribbons and yarns into bodies, and write model files."""
