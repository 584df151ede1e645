"""Defines what reports share: rows with a verdict, tables, figures, and one HTML page that needs no network."""
