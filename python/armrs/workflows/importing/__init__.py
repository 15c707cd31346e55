"""Own recordings into a data set."""

from .run import Imported as Imported
from .run import import_recordings as import_recordings
from .run import model_file as model_file
