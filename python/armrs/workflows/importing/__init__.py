"""Conversion of recordings to a data set: `armrs import`."""

from .run_import import Imported as Imported
from .run_import import import_recordings as import_recordings
from .run_import import model_file as model_file
