"""Models that users bring: loaded from a file or an entry point, checked, tried out, and blamed by line."""
