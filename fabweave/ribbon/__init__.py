"""Turn threads into ribbons in space, check them, and export them."""
