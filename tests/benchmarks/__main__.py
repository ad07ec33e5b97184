"""All benchmarks: ``python -m tests.benchmarks``. Each prints ratios measured in one run."""

from tests.benchmarks import background, episode, jpda, render, tracker, traffic

if __name__ == "__main__":
    for benchmark in (traffic, render, tracker, background, jpda, episode):
        print(f"\n## {benchmark.__name__.rsplit('.', 1)[-1]}")
        benchmark.main()
