"""What files say: supremal's own JSON, read strictly, and the model files of other programs."""

from supremal.formats.documents import read_automaton, read_reward_machine
from supremal.formats.files import FORMATS, Format, read_model, write_model
from supremal.formats.logs import CsvLog, TensorBoardLog, log_live, log_result
from supremal.formats.machine_text import read_machine_text
from supremal.formats.model import Model
from supremal.formats.processes import PROCESS_FORMATS, read_process, write_process

__all__ = [
    "FORMATS",
    "PROCESS_FORMATS",
    "CsvLog",
    "Format",
    "Model",
    "TensorBoardLog",
    "log_live",
    "log_result",
    "read_automaton",
    "read_machine_text",
    "read_model",
    "read_process",
    "read_reward_machine",
    "write_model",
    "write_process",
]
