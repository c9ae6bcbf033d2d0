"""How long ``import amb_design`` takes, against the libraries that it stands on.

Fresh processes of this interpreter take turns with ``import casadi, numpy, scipy.linalg`` and ``import amb_design``; the
medians of their CPU seconds are compared. The goal is a ratio of at most 1.5. Run::

    python benchmarks/import_time.py
"""

import argparse
import os
import statistics
import subprocess
import sys

from common import write

CODE = {"libraries": "import casadi, numpy, scipy.linalg", "amb_design": "import amb_design", "bare": "pass"}


def seconds(code):
    """CPU seconds of a fresh interpreter that runs the code."""
    before = os.times()
    subprocess.run([sys.executable, "-c", code], check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main():
    parser = argparse.ArgumentParser(description="Time the import of amb_design.")
    parser.add_argument("--repeat", type=int, default=15)
    repeat = parser.parse_args().repeat
    for code in CODE.values():  # byte code and file cache
        seconds(code)
    turns = [{name: seconds(code) for name, code in CODE.items()} for _ in range(repeat)]
    median = {name: statistics.median(turn[name] for turn in turns) for name in CODE}
    ratio = median["amb_design"] / median["libraries"]
    for name, code in CODE.items():
        print(f"{code:40s} {median[name]:6.3f} s")
    print(f"ratio {ratio:.2f} (goal: at most 1.5)")
    write("import_time", {"repeat": repeat, "seconds": median, "ratio": ratio, "goal": 1.5})


if __name__ == "__main__":
    main()
