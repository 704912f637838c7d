import sys
from pathlib import Path

# The specimen maker is a module of its own beside the tests.
sys.path.insert(0, str(Path(__file__).parent))
