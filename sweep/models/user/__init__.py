"""Users' models: loaded from a file, checked, tried out, with errors traced to their line."""
