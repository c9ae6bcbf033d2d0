"""What the benchmarks share: medians of CPU seconds with one BLAS thread, and results as JSON."""

import datetime
import gc
import json
import platform
import statistics
import time
from importlib.metadata import version
from pathlib import Path

from threadpoolctl import threadpool_limits

RESULTS = Path(__file__).parent / "results"


def cpu_seconds(job, prepare=lambda: (), repeat=9):
    """Median CPU seconds of ``job(*prepare())``; preparing is not counted, nor is one run before to load everything."""
    job(*prepare())
    seconds = []
    with threadpool_limits(1, user_api="blas"):
        for _ in range(repeat):
            arguments = prepare()
            gc.collect()
            start = time.process_time()
            job(*arguments)
            seconds.append(time.process_time() - start)
    return statistics.median(seconds)


def processor():
    """Name of the processor, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def write(name, report):
    """Write a report to ``results/NAME.json``, with the date and the versions."""
    about = {
        "date": datetime.date.today().isoformat(),
        "processor": processor(),
        "versions": {"python": platform.python_version()} | {p: version(p) for p in ("casadi", "numpy", "scipy")},
        "time_unit": "CPU seconds, one BLAS thread, medians",
    }
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(about | report, indent=2) + "\n")
    print(f"written: {path.parent.name}/{path.name}")
