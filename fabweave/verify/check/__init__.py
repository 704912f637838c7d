"""Check a finished job: its weave, ribbons, pieces, joints, sheets and steps."""
