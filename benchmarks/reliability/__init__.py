"""How far the package can be trusted: fuzzing, long runs, numerical sensitivity; see docs/reliability.md."""
