"""Check the plan by itself: the weave, the pieces, their joints, the steps of the assembly."""
