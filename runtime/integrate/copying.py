"""Copy within jitted loops: NumPy's slice assignment allocates memory where arrays might overlap."""

from symgen.runtime.code.jitted import jitted


@jitted
def copy(source, target):
    """Copy `source` into the first entries of `target`."""
    for i in range(source.shape[0]):
        target[i] = source[i]
