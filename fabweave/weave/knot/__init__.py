"""Write weaves as knot theory writes links."""
