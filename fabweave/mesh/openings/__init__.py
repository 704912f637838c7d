"""Leave faces out of a mesh, so that there is an opening with a rim."""
