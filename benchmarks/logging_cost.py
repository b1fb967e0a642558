"""What a recording at 60 frames per simulated second adds to the time of a run, for runs long enough to tell.

    python benchmarks/logging_cost.py [MODEL …]

For each model: seconds of the run without a recorder and with one until all is written, the smallest of some
repetitions; how long the run takes for a frame; processor time that logging adds to a frame in the run's own thread and
in the one beside it that writes; and bytes on file. On a machine with a processor to spare, a run that takes longer for
a frame than its writing does hardly waits for it. Loading Rerun, which a process does once, is shown apart.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from symgen import runtime
from symgen.link import module_for
from symgen.model.library import find
from symgen.runtime import solve
from symgen.runtime.code import stand_ins
from symgen.runtime.recording.recorder import RunRecorder

MODELS = ("double_pendulum", "four_bar", "seven_dof_arm", "n_pendulum", "chain_absolute")
FPS = 60.0
LEAST_SECONDS, FIRST_T_END = 1.0, 2.0
REPETITIONS = 3


def main() -> None:
    """Read the command line, measure, print a table."""
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=MODELS, metavar="MODEL")
    parser.add_argument("--method", default="auto")
    options = parser.parse_args()
    began = time.perf_counter()
    from symgen.runtime.recording.rrd import write  # noqa: F401  loaded before anything is timed

    print(f"Rerun is loaded in {time.perf_counter() - began:.2f} s, once")
    print(
        f"{'model':<20} {'frames':>7} {'run [s]':>8} {'with log':>9} {'added':>7} "
        f"{'a frame: run':>13} {'log here':>9} {'beside':>8} {'bytes':>6}"
    )
    for model in options.models:
        print(measure(model, options.method))


def measure(model: str, method: str) -> str:
    """Return a line of the table."""
    text = module_for(Path(find(model)), {}, None).text
    system = runtime.load(text)
    t_end = FIRST_T_END
    while (plain := seconds(system, t_end, method)) < LEAST_SECONDS and t_end < 4000.0:
        t_end *= min(8.0, max(1.5, 1.2 * LEAST_SECONDS / max(plain, 1e-6)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.rrd"
        pairs = [
            (*timed(system, t_end, method), *timed(system, t_end, method, path, text))
            for _ in range(REPETITIONS)
        ]
        size = path.stat().st_size
    alone, own_alone, all_alone, logged, own, everything = (min(column) for column in zip(*pairs))
    n = int(FPS * t_end)
    here, beside = own - own_alone, everything - all_alone - (own - own_alone)
    run, here, beside = (f"{1e6 * took / n:.1f} µs" for took in (alone, here, beside))
    return (
        f"{model:<20} {n:>7} {alone:>8.3f} {logged:>9.3f} {logged / alone - 1.0:>7.1%} "
        f"{run:>13} {here:>9} {beside:>8} {size / n:>6.0f}"
    )


def timed(*arguments) -> tuple[float, float, float]:
    """Return `seconds(*arguments)`, and the processor time of this thread and of all threads."""
    own, everything = time.thread_time(), time.process_time()
    took = seconds(*arguments)
    return took, time.thread_time() - own, time.process_time() - everything


def seconds(
    system: runtime.System, t_end: float, method: str, path: Path | None = None, text: str = ""
) -> float:
    """Return the wall time of integrating, with writing frames to `path` where one is given."""
    made = []

    def recorder(**settings) -> RunRecorder:
        made.append(RunRecorder(path, module_text=text, model_text="", **settings))
        return made[0]

    solution = solve(system, t_end, method=method, fps=FPS, recorder=None if path is None else recorder)
    took = solution.seconds["run"]
    if made:
        began = time.perf_counter()
        made[0].finish(solution.status, [], solution.stats)
        took += time.perf_counter() - began
    return took


if __name__ == "__main__":
    main()
