"""All benchmarks: ``python -m tests.benchmarks``, and at the end what was measured against what is wanted."""

import os

from tests.benchmarks import aerial, datasets, episode, jpda, lane, render, tracker, traffic
from tests.benchmarks.lines import table

if __name__ == "__main__":
    lines = []
    before = os.getloadavg()[0]
    for benchmark in (traffic, render, tracker, episode, lane, aerial, jpda, datasets):
        print(f"\n## {benchmark.__name__.rsplit('.', 1)[-1]}", flush=True)
        lines += benchmark.main()
    print(f"\n## all\n{table(lines)}")
    print(
        f"\n{os.cpu_count()} cores; load average {before:.1f} before, {os.getloadavg()[0]:.1f} after: "
        "what else runs slows the loop down, and leaves ratios and the tracker's CPU time as they are."
    )
