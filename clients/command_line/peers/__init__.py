"""Other renderers, given our own scenes: for the benchmark, and for the tests that hold our pictures against theirs."""
