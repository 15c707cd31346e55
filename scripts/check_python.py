"""Stop with one line when this Python is too old."""

import sys

if sys.version_info < (3, 10):
    sys.exit(f"armrs needs Python 3.10 or newer, this is {sys.version.split()[0]}: make PYTHON=python3.12")
