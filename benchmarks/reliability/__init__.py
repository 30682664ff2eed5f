"""How far the package can be trusted: fuzzing, long runs, sensitivity; see docs/reliability.md."""
