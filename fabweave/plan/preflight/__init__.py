"""Check pieces against the rules of those who cut them."""
