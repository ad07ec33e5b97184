"""The command line. Only typer is imported here: what a command needs, it imports when it runs."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from scenarios.errors import InputError
from scenarios.interrupts import Interrupted, interrupts

if TYPE_CHECKING:
    from scenarios.workers import Progress

UsageError: type[typer.BadParameter] = typer.BadParameter.__bases__[0]  # typer does not name it itself
CANNOT = 1
BAD_INPUT = 2
INTERRUPTED = 130
CANNOT_BE_DONE = ("RenderUnavailableError", "WorkersLostError")
"""Errors that are nobody's mistake here; by name, since whoever defines them is heavy."""

app = typer.Typer(
    name="testtrack",
    help="A test track for vehicle trackers: simulated drives with exact truth, trackers, and scores.",
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=False,
)


class Boxes(StrEnum):
    """Which truth is scored."""

    AMODAL = "amodal"
    VISIBLE = "visible"


class Format(StrEnum):
    """How a dataset is laid out."""

    MOT = "mot"
    COCO = "coco"
    KITTI = "kitti"


class Coding(StrEnum):
    """How the pictures of a dataset are stored."""

    PNG = "png"
    FFV1 = "ffv1"
    H264 = "h264"


Out = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Write report, tracks, scores and log here; new or empty, or written before."
    ),
]
ScenarioName = Annotated[
    str, typer.Argument(metavar="SCENARIO|FILE.toml", help="A scenario's name, or a file.")
]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Which drive; 0 if not said.")]
Jobs = Annotated[int, typer.Option(metavar="J", help="Processes; what comes out does not depend on it.")]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Of a Dask scheduler that does the work; its workers must see --out under the same name.",
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Such as sensor.noise=3; once or more."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of tables.")]


@app.command("list")
def list_all(as_json: Json = False) -> None:
    """Name the scenarios and the trackers."""
    from scenarios import spec
    from tracker.registry import TRACKERS

    described = {name: spec.load(name).description for name in spec.library()}
    if as_json:
        _print_json({"scenarios": described, "trackers": list(TRACKERS)})
        return
    from scenarios.tables import print_names

    print_names(described, TRACKERS)


@app.command()
def run(
    scenario: ScenarioName,
    seed: Seed = None,
    seeds: Annotated[str | None, typer.Option(metavar="A:B", help="The drives A, A+1, ... B-1.")] = None,
    jobs: Jobs = 1,
    cluster: Cluster = None,
    tracker: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|module:object",
            help="Once or more; the scene's own if not said. One that starts at detections takes @DETECTOR: "
            "@perfect, @noisy, @mask, or @ one of ours; with association@DETECTOR the association is true.",
        ),
    ] = None,
    overrides: Overrides = None,
    boxes: Annotated[Boxes, typer.Option(help="Which boxes of the truth are scored.")] = Boxes.AMODAL,
    odometry: Annotated[
        bool, typer.Option("--odometry", help="Give the trackers the car's odometry.")
    ] = False,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Drop the frames that come while a tracker is still busy.")
    ] = False,
    figure: Annotated[
        list[Path] | None,
        typer.Option(metavar="PICTURE", help="A PNG or JPEG to show in the reports; once or more."),
    ] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Simulate drives, let trackers follow them, and score what they found."""
    chosen = _seeds(seed, seeds)
    _check_jobs(jobs, cluster)
    from scenarios import spec

    resolved = spec.load(scenario, overrides or ())
    names = tuple(tracker or (resolved.scene,))
    if len(set(names)) < len(names):
        raise InputError(f"--tracker {' --tracker '.join(names)}: wanted each tracker once")
    from scenarios.output import whole_directory
    from scenarios.runs import Run, check_figure, execute, make_tracker
    from scenarios.workers import open_workers

    for name in names:
        make_tracker(name, resolved)
    for picture in figure or ():
        check_figure(picture)
    wanted = Run(
        scenario=resolved,
        seeds=chosen,
        trackers=names,
        boxes=boxes.value,
        odometry=odometry,
        realtime=realtime,
        figures=tuple(figure or ()),
    )
    place = whole_directory(out) if out else nullcontext()
    with (
        open_workers(min(jobs, len(chosen)), cluster) as workers,
        place as directory,
        _progress(resolved.name, wanted.frames) as advance,
    ):
        document = execute(wanted, directory, advance, workers=workers)
    if as_json:
        _print_json(document)
    else:
        from scenarios.tables import print_scores

        print_scores(document)
    if out:
        _say_where(out)


@app.command()
def track(
    video: Annotated[Path, typer.Argument(metavar="VIDEO", help="A recording of a real camera.")],
    method: Annotated[str, typer.Option(metavar="NAME|module:object", help="Which tracker, such as in-car.")],
    focal: Annotated[
        float | None, typer.Option(metavar="PX", help="Focal length in pixels of the recording, where known.")
    ] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Let a tracker follow a recording of a real camera."""
    from scenarios.video import Video

    with Video(video) as opened:
        from scenarios.output import whole_directory
        from scenarios.recording import follow

        place = whole_directory(out) if out else nullcontext()
        with place as directory, _progress(video.name, opened.announced or None) as advance:
            document = follow(opened, method, focal=focal, directory=directory, progress=advance)
    if as_json:
        _print_json(document)
    else:
        from scenarios.tables import print_recording

        print_recording(document)
    if out:
        _say_where(out)


@app.command()
def generate(
    scenario: ScenarioName,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="New or empty, or begun by the same command: it goes on.")
    ],
    layout: Annotated[Format, typer.Option("--format", help="Whose layout.")] = Format.MOT,
    count: Annotated[int, typer.Option(metavar="N", help="How many drives.")] = 1,
    seed: Annotated[int, typer.Option(metavar="N", help="The first drive.")] = 0,
    frames: Annotated[Coding, typer.Option(help="PNG and FFV1 lose nothing.")] = Coding.PNG,
    jobs: Jobs = 1,
    cluster: Cluster = None,
    overrides: Overrides = None,
    as_json: Json = False,
) -> None:
    """Write drives as a dataset: pictures, boxes, masks, depth, calibration, poses, occlusions."""
    if count < 1:
        raise InputError(f"--count {count}: wanted a whole number of at least 1")
    first = _seeds(seed, None).start
    _check_jobs(jobs, cluster)
    from scenarios import spec

    resolved = spec.load(scenario, overrides or ())
    from scenarios.dataset import Dataset
    from scenarios.generate import generate as write
    from scenarios.workers import open_workers

    dataset = Dataset(
        scenario=resolved, seeds=range(first, first + count), format=layout.value, coding=frames.value
    )
    with (
        open_workers(min(jobs, count), cluster) as workers,
        _progress(resolved.name, dataset.frames) as advance,
    ):
        document = write(dataset, out.absolute(), workers, advance)
    if as_json:
        _print_json(document)
    else:
        print(f"{document['episodes']} episodes, {document['frames']} frames in {out}")


@app.command()
def replay(
    manifest: Annotated[
        Path, typer.Argument(metavar="MANIFEST", help="A manifest.json, of run or generate.")
    ],
    as_json: Json = False,
) -> None:
    """Run what a manifest describes again, and say whether all comes out the same, or what differs first."""
    from scenarios import manifest as manifests
    from scenarios.replay import describe
    from scenarios.replay import replay as run_again

    made = manifests.read(manifest)
    with _progress(made.scenario.name, made.frames) as advance:
        document = describe(made, run_again(made, advance))
    if as_json:
        _print_json(document)
    else:
        from scenarios.tables import print_replay

        print_replay(document)
    raise typer.Exit(0 if document["agree"] else CANNOT)


@app.command()
def check(
    tracker: Annotated[
        str, typer.Argument(metavar="NAME|module:object", help="A tracker, such as my_tracker:MyTracker.")
    ],
) -> None:
    """Tell what a tracker does that its contract forbids, rule by rule; exit with 1 if there is anything."""
    from tracker.base import ContractError, check_tracker
    from tracker.registry import build

    try:
        candidate = build(tracker)
    except ValueError as error:
        raise InputError(str(error)) from error
    try:
        check_tracker(candidate)
    except ContractError as error:
        print(error)
        raise typer.Exit(1) from None
    print(f"{tracker} keeps the contract")


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what works here, what does not, and the command that mends it."""
    from scenarios.doctor import examine

    checks = examine()
    if as_json:
        _print_json([{"name": c.name, "ok": c.ok, "detail": c.detail, "remedy": c.remedy} for c in checks])
    else:
        from scenarios.tables import print_checks

        print_checks(checks)
    raise typer.Exit(0 if all(check.ok for check in checks) else 1)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line; exit with 0 done, 1 cannot be done here, 2 bad input or 130 interrupted."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # it would greet on stdout
    sys.path.append(os.getcwd())  # where a reader's own module:object is looked for
    try:
        command = typer.main.get_command(app)
        with interrupts():
            code = command.main(args=arguments, prog_name="testtrack", standalone_mode=False)
        sys.exit(code or 0)
    except InputError as error:
        _fail(str(error), BAD_INPUT)
    except UsageError as error:
        _fail(error.format_message(), BAD_INPUT)
    except Interrupted:
        _fail("interrupted", INTERRUPTED)
    except RuntimeError as error:
        if type(error).__name__ not in CANNOT_BE_DONE:
            raise
        _fail(str(error), CANNOT)


def _fail(message: str, code: int) -> NoReturn:
    print(f"testtrack: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)


def _check_jobs(jobs: int, cluster: str | None) -> None:
    if jobs < 1:
        raise InputError(f"--jobs {jobs}: wanted a whole number of at least 1")
    if jobs > 1 and cluster is not None:
        raise InputError("--jobs and --cluster: wanted one of them")


def _seeds(seed: int | None, seeds: str | None) -> range:
    if seeds is None:
        if seed is not None and seed < 0:
            raise InputError(f"--seed {seed}: wanted a whole number of at least 0")
        return range(seed or 0, (seed or 0) + 1)
    if seed is not None:
        raise InputError("--seed and --seeds: wanted one of them")
    first, colon, end = seeds.partition(":")
    if not (colon and first.isdecimal() and end.isdecimal() and int(first) < int(end)):
        raise InputError(f"--seeds {seeds}: wanted A:B with 0 <= A < B, such as 0:10 for the seeds 0 to 9")
    return range(int(first), int(end))


@contextmanager
def _progress(what: str, total: int | None) -> Iterator[Progress | None]:
    """Show a bar of frames on stderr, where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(what, total=total)
        yield lambda frames: bars.advance(task, frames)


def _print_json(document: Any) -> None:
    from scenarios.output import to_json

    print(to_json(document))


def _say_where(out: Path) -> None:
    reports = sorted(out.rglob("report.html"))
    print(f"report: {reports[0]}" if len(reports) == 1 else f"written to {out}", file=sys.stderr)


if __name__ == "__main__":
    main()
