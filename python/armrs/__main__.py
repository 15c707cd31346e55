"""`python -m armrs` is the command `armrs`."""

from .cli import run

run()
