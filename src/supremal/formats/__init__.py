"""What files say: supremal's own JSON, read strictly, and the model files of other programs."""

from supremal.formats.documents import read_automaton, read_reward_machine
from supremal.formats.files import FORMATS, Format, read_model, write_model
from supremal.formats.model import Model

__all__ = [
    "FORMATS",
    "Format",
    "Model",
    "read_automaton",
    "read_model",
    "read_reward_machine",
    "write_model",
]
