"""A process that runs scenarios: names come on standard input, outcomes go back as lines of JSON."""

from __future__ import annotations

import json
import os
import sys
import time
import warnings
from pathlib import Path

from .scenario import CRASH, Outcome, all_scenarios


def main() -> None:
    # What libraries print must not get between the answers.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    scenarios = all_scenarios()
    for line in sys.stdin:
        began = time.perf_counter()
        try:
            outcome = scenarios[line.strip()].run()
        except Exception as error:
            place = error.__traceback__
            while place.tb_next is not None:
                place = place.tb_next
            where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
            outcome = Outcome(CRASH, f"{type(error).__name__} at {where}: {error}")
        print(
            json.dumps({**outcome.to_dict(), "seconds": time.perf_counter() - began}),
            file=answers,
            flush=True,
        )


if __name__ == "__main__":
    main()
