"""All benchmarks: ``python -m tests.benchmarks``, and at the end what was measured against what is wanted."""

from tests.benchmarks import episode, render, tracker, traffic
from tests.benchmarks.lines import table

if __name__ == "__main__":
    lines = []
    for benchmark in (traffic, render, tracker, episode):
        print(f"\n## {benchmark.__name__.rsplit('.', 1)[-1]}", flush=True)
        lines += benchmark.main()
    print(f"\n## all\n{table(lines)}")
