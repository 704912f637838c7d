"""Check the ribbons in space, and the pieces that are unfolded from them."""
