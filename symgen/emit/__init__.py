"""From a derived program to the text of its generated module: plain, readable, deterministic Python."""
