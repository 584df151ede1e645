"""What the reports share: rows with a verdict, tables and figures, one page that needs no network."""
