"""The pure parts alone, by Google Benchmark."""
import json
import os
import pathlib
import subprocess

from measures import rig
from measures.figures import Row

PART = "pure part, ns"


def program():
    return pathlib.Path(os.environ.get("BENCH_MICRO", rig.harness.ROOT / "build/release/bench_micro"))


def measure(run):
    if not program().exists():
        run.left_out.append("pure parts (bench_micro is not built; libbenchmark-dev is needed)")
        return
    done = subprocess.run([program(), "--benchmark_format=json",
                           f"--benchmark_min_time={0.1 if run.quick else 0.5}"],
                          capture_output=True, text=True, check=True)
    for one in json.loads(done.stdout)["benchmarks"]:
        if one.get("run_type") != "aggregate":
            yield Row(PART, one["name"], "this tree", one["cpu_time"], "ns")
        elif "big_o" in one:
            yield Row("pure part, ns for each", f"{one['name']} {one['big_o']}", "this tree",
                      one["cpu_coefficient"], "ns")
