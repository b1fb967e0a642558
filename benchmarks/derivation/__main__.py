"""Derive seconds, peak memory, operations, compile seconds and ns a call of M and f, over the links of a planar chain.

    python benchmarks/derivation [--links 2 5 10 20 50] [--limit SECONDS] [--json FILE] [--png FILE]

Each tool runs in a process of its own; CasADi only where it is installed (`pip install 'symgen[bench]'`). All tools
must agree on M and f at one state to 1e-9, or the row says so. A tool that passed the time limit is not asked for
longer chains. Object code is kept in an empty cache of this run's own.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
COLUMNS = ("derive s", "operations", "compile s", "ns", "peak MB")


def one(tool: str, links: int) -> dict[str, float]:
    """Figures of one tool, measured in this process."""
    from tools import TOOLS

    sys.setrecursionlimit(100_000)
    figures = TOOLS[tool](links)
    figures["peak MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return figures


def in_own_process(tool: str, links: int, limit: float) -> dict[str, float | str]:
    """Figures of one tool, or why there are none."""
    command = [sys.executable, str(HERE), "--one", tool, str(links)]
    with tempfile.TemporaryDirectory() as cache:
        own = os.environ | {"SYMGEN_CACHE_DIR": cache}
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=own,
            start_new_session=True,
        )
        try:
            output, errors = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # with the C compiler that it may have started
            process.communicate()
            return {"failure": f"> {limit:g} s"}
    if process.returncode:
        return {"failure": (errors.strip().splitlines() or ["failed"])[-1][:80]}
    return json.loads(output.splitlines()[-1])


def measure(lengths: list[int], limit: float) -> list[dict]:
    """All rows; `agrees` compares with the first tool's M and f."""
    from tools import TOOLS

    rows, gone = [], set()
    for links in lengths:
        reference = None
        for tool in TOOLS:
            if tool in gone:
                continue
            figures = in_own_process(tool, links, limit)
            row = {"links": links, "tool": tool, **figures}
            if "failure" in figures:
                gone.add(tool)
            else:
                reference = figures["check"] if reference is None else reference
                row["agrees"] = abs(figures["check"] - reference) <= 1e-9 * max(1.0, abs(reference))
            rows.append(row)
            print(row, file=sys.stderr)
    return rows


def print_table(rows: list[dict]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("links", "tool", *COLUMNS, "")
    for row in rows:
        cells = [f"{row[c]:.3g}" if c != "operations" else f"{row[c]:.0f}" for c in COLUMNS if c in row]
        note = row.get("failure") or ("" if row["agrees"] else "DISAGREES")
        table.add_row(str(row["links"]), row["tool"], *(cells or [""] * len(COLUMNS)), note)
    Console(width=110).print(table)


def draw(rows: list[dict], path: Path) -> None:
    """Derive seconds and operations over the number of links."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    axes = figure.subplots(1, 2)
    for ax, column in zip(axes, ("derive s", "operations"), strict=True):
        for tool in dict.fromkeys(row["tool"] for row in rows):
            points = [(row["links"], row[column]) for row in rows if row["tool"] == tool and column in row]
            if points:
                ax.loglog(*zip(*points, strict=True), marker="o", label=tool)
        links = sorted({row["links"] for row in rows})
        ax.set(xlabel="links of the chain", ylabel=column, xticks=links, xticklabels=[str(n) for n in links])
        ax.minorticks_off()
        ax.grid(True, which="both", alpha=0.3)
    axes[0].legend()
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--links", type=int, nargs="+", default=[2, 5, 10, 20, 50])
    parser.add_argument("--limit", type=float, default=120.0, help="seconds a tool may take")
    parser.add_argument("--json", type=Path, help="write the figures to this file too")
    parser.add_argument("--png", type=Path, help="draw them to this file")
    parser.add_argument("--one", nargs=2, metavar=("TOOL", "LINKS"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(one(chosen.one[0], int(chosen.one[1]))))
        return
    rows = measure(chosen.links, chosen.limit)
    print_table(rows)
    if chosen.json:
        chosen.json.write_text(json.dumps(rows, indent=1))
    if chosen.png:
        draw(rows, chosen.png)


if __name__ == "__main__":
    main()
