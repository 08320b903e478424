"""Which examples of docstrings cannot run here, because the extra that they need is not installed."""

from importlib.util import find_spec

NEEDS = {  # the files that import it, and the package
    "src/supremal/deep/_rllib.py": "ray",
    "src/supremal/deep/rllib.py": "ray",
    "src/supremal/deep/masked_dqn.py": "torch",
    "src/supremal/deep/_[!r]*.py": "torch",
    "src/supremal/envs/_moviepy.py": "moviepy",
    "src/supremal/envs/_pettingzoo.py": "pettingzoo",
    "src/supremal/envs/team.py": "pettingzoo",
    "src/supremal/studies/_ray.py": "ray",
    "src/supremal/studies/cluster.py": "ray",
}

collect_ignore_glob = [files for files, package in NEEDS.items() if find_spec(package) is None]
