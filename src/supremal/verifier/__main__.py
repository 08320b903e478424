"""``python path/to/verifier FILE``, or ``python -m verifier FILE`` in the folder that holds it."""

import sys
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    folder = Path(__file__).resolve().parent
    if not __package__:  # run by its path: Python looks for modules in this folder, not in its parent
        sys.path[0] = str(folder.parent)
    sys.exit(import_module(__package__ or folder.name).main(sys.argv[1:]))
