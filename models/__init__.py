"""The bundled models: data, and scripts with a `build` function; found by `symgen.model.library`."""
