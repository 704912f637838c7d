"""Let tests import what they share (strategies, shared meshes), and settle Hypothesis."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))

# A time limit for single examples fails on a busy machine, and says nothing about the code.
settings.register_profile("fabweave", deadline=None)
settings.load_profile("fabweave")
