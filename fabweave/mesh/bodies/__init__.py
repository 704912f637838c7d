"""Choose which bodies of a mesh are woven: some of them, all joined, or one surface around them."""
