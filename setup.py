"""Which folder is which package; everything else stands in pyproject.toml.

`runtime/` and `models/` stand at the top level, where people look for them; as
imports and in site-packages all of it lies below `symgen`, a name that nobody else claims.
"""

from setuptools import find_packages, setup

FOLDERS = {
    "symgen": "symgen",
    "symgen.runtime": "runtime",
    "symgen.bundled": "models",
}

setup(
    package_dir=FOLDERS,
    packages=[
        *FOLDERS,
        *(f"symgen.{name}" for name in find_packages("symgen")),
        *(f"symgen.runtime.{name}" for name in find_packages("runtime")),
    ],
    package_data={
        "symgen": ["py.typed"],
        "symgen.bundled": ["*.toml", "references/*.json", "robots/*"],
        "symgen.runtime.code": ["loops/*.xz", "loops/as_written.txt"],
    },
)
