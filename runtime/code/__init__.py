"""How functions become machine code: lowering, compiling, caching, calling."""
