"""Users' models: loaded from a file or an entry point, checked, tried out, with errors traced to their line."""
